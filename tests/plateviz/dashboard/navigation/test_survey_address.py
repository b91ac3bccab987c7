"""Address of the Survey page: what it leaves to the orbit, and what it carries on to it."""

import pytest

from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.session.session import Session


def reloaded(page):
    """Another page that was opened by the address of a page."""
    opened = Navigation(Session(page.session.store))
    opened.begin(page.address())
    return opened


@pytest.mark.parametrize("n_reloads", [0, 1, 2])
def test_reload_of_the_survey_leaves_what_the_orbit_begins_with(navigation, n_reloads):
    navigation.begin({})
    assert not {"field", "plates", "detector"} & set(navigation.address())
    page = navigation
    for _ in range(n_reloads):
        page = reloaded(page)
    page.turn_to(View.ORBIT)
    part = page.session.shown_part
    assert (part.field, part.plates, part.detector) == ("0", (0, 0), "0")
    assert page.session.notice == ""


def test_what_is_asked_for_stays_in_the_address_until_the_orbit_is_there(navigation):
    wanted = {"view": "survey", "field": "2", "plates": "2-2"}
    navigation.begin(wanted)
    page = reloaded(navigation)
    assert wanted.items() <= page.address().items()
    assert "detector" not in page.address()
    page.turn_to(View.ORBIT)
    part = page.session.shown_part
    assert (part.field, part.plates, part.detector) == ("2", (2, 2), "0")


def test_addresses_with_a_kept_selection_leave_nothing_behind(navigation):
    def watchers():
        found = navigation.session.param.watchers.get("shown", {}).get("value", [])
        return len(found)

    navigation.begin({"view": "survey", "selection": "corner", "sources": "5"})
    before = watchers()
    for _ in range(3):
        navigation.begin({"view": "survey", "selection": "corner", "sources": "5"})
    assert watchers() == before > 0
