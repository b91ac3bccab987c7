"""The browser's address: what it names while solutions are on their way, and back and forward."""

from urllib.parse import parse_qs

import pytest

from plateviz.dashboard.session.solution import Request
from plateviz.dashboard.views.browser.address_bar import AddressBar
from solver.data.settings import FitSettings
from tests.plateviz.dashboard.navigation.test_navigation import end_job


def test_address_names_what_is_being_computed_and_not_what_the_page_began_with(navigation):
    navigation.begin({"view": "orbit", "orbit": "0", "solution": "order=3 what-if"})
    assert navigation.address()["solution"] == "order=3 what-if"
    end_job(navigation)
    bar = AddressBar(navigation)
    later = Request(1, FitSettings(order=4), is_what_if=True)
    navigation.session.open_listed(later)
    assert navigation.session.is_opening
    assert navigation.address()["solution"] == "order=4 what-if"
    assert "orbit=1" in bar.query
    assert "solution=order=4+what-if" in bar.query
    end_job(navigation)
    assert navigation.address()["solution"] == "order=4 what-if"


def test_address_of_the_next_orbit_names_its_solution_from_the_first_moment(navigation):
    navigation.begin({"view": "orbit", "orbit": "0", "solution": "order=3 what-if"})
    end_job(navigation)
    navigation.session.list_what_if()
    bar = AddressBar(navigation)
    queries = []
    bar.param.watch(lambda event: queries.append(event.new), "query")
    navigation.choose_orbit(1)
    end_job(navigation)
    named = [parse_qs(query) for query in queries]
    assert named
    assert all((one["orbit"], one["solution"]) == (["1"], ["order=3"]) for one in named)


def test_step_back_is_answered_after_what_it_shows(navigation):
    navigation.open_orbit(0)
    bar = AddressBar(navigation)
    before = bar.query
    navigation.choose_orbit(1)
    changes = []
    bar.param.watch(lambda event: changes.append((event.name, event.new)), ["query", "answered"])
    bar._handle_msg({"number": 3, "query": before})
    assert changes == [("query", before), ("answered", 3)]


@pytest.mark.parametrize("data", ["orbit=1", None, {}, {"number": "1", "query": "orbit=1"}, 7])
def test_message_of_another_kind_does_nothing(navigation, data):
    bar = AddressBar(navigation)
    before = bar.query
    bar._handle_msg(data)
    assert (bar.query, bar.answered) == (before, 0)


@pytest.mark.parametrize("query", [None, "&".join("a=1" for _ in range(200)), "orbit=%ff", ""])
def test_step_that_means_nothing_is_answered_too(navigation, query):
    bar = AddressBar(navigation)
    bar._handle_msg({"number": 1, "query": query})
    assert bar.answered == 1
