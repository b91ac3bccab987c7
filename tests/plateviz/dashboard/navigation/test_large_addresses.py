"""What is too large for an address is found again by another page of the same server."""

import pytest

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.session.session import Session
from solver.data.subset import Subset
from tests.plateviz.dashboard.navigation.test_navigation import end_job

MANY = frozenset(range(4_000_000_000_000_000_000, 4_000_000_000_000_000_400))


@pytest.fixture
def large():
    return LargeSelections()


@pytest.fixture
def on_server(navigation, large):
    """Return another page over the same store."""

    def opened(address):
        found = Navigation(Session(navigation.session.store, large))
        found.begin(address)
        return found

    return opened


@pytest.fixture
def without_many(navigation, on_server):
    """A page with a what-if of order 4 without 400 sources and a detector."""
    page = on_server({"view": "orbit", "orbit": "0"})
    exclusions = ", ".join(["detector=1", *(f"source={number}" for number in sorted(MANY))])
    page.session.choices.param.update(order=4, exclusions=exclusions)
    end_job(page)
    return page


def test_what_if_without_many_sources_is_there_again(without_many, on_server):
    address = without_many.address()
    assert len(address["solution"]) < 100
    assert address["solution"].endswith("what-if")
    again = on_server(address)
    end_job(again)
    assert again.session.notice == ""
    shown = again.session.shown
    assert shown.settings.order == 4
    assert shown.settings.exclusions == Subset(sources=MANY, detectors=frozenset([1]))
    assert shown.is_replaceable
    assert again.address() == address


def test_what_if_without_many_sources_is_told_where_it_is_not_known(without_many, navigation):
    other = Navigation(Session(navigation.session.store))
    other.begin(without_many.address())
    assert "solution: the settings were too many for the address" in other.session.notice
    assert other.session.shown.run == "default"


def test_large_selection_is_there_again(on_server):
    page = on_server({"view": "orbit", "orbit": "0"})
    page.session.selection.select(Subset(sources=MANY))
    again = on_server(page.address())
    assert again.session.selection.sources == MANY
    assert again.session.notice == ""
