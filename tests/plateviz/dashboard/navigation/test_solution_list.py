"""Solutions of a page: listed, shown, named, kept, compared, and found again after a reload."""

import pytest

from plateviz.dashboard.navigation.solution_list import SolutionList, by_label
from plateviz.dashboard.session.journal import Journal
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.solution import Request
from plateviz.runs.kept_solutions import KeptSolutions
from plateviz.solving.made_solutions import MadeSolution, MadeSolutions
from solver.data.settings import FitSettings
from solver.errors import InputError
from tests.plateviz.dashboard.navigation.test_navigation import end_job

KEY = "0123456789abcdef" * 2


@pytest.fixture
def page(navigation, run, tmp_path, fit_result):
    """A page with the orbit of a run and a listed what-if; its store has one kept solution."""
    store = navigation.session.store
    store.kept = KeptSolutions(tmp_path / "solutions")
    store.kept.keep("old", 0, False, fit_result)
    run.directory = tmp_path
    navigation.open_orbit(0)
    navigation.session.choices.order = 4
    end_job(navigation)
    navigation.session.list_what_if()
    return navigation


def labels(page):
    return list(by_label(SolutionList(page).entries()))


def entry(page, label):
    return by_label(SolutionList(page).entries())[label]


def test_list_has_the_solutions_of_the_session_the_kept_ones_and_those_of_runs(page):
    assert labels(page) == [
        "orbit 0: order 4 (what-if)",
        "orbit 0: old: order 5 (fit, kept)",
        "orbit 0: default: order 5 (run)",
    ]
    page.choose_orbit(1)
    end_job(page)
    # Those of the session and the kept ones are of all orbits.
    assert labels(page) == [
        "orbit 1: order 4 (fit)",
        "orbit 0: order 4 (what-if)",
        "orbit 0: old: order 5 (fit, kept)",
    ]


def test_what_if_of_another_orbit_follows_the_solution_of_the_run(page, run, monkeypatch):
    monkeypatch.setattr(run, "has_fitted", lambda orbit: True)
    session = page.session
    session.choices.order = 3
    end_job(page)
    assert session.shown.is_replaceable
    page.choose_orbit(1)
    assert (session.shown.run, session.shown.orbit) == ("default", 1)
    assert session.job is not None
    end_job(page)
    shown = session.shown
    assert (shown.orbit, shown.is_replaceable, shown.settings.order) == (1, True, 3)
    assert (session.other.run, session.choices.order) == ("default", 3)


def test_what_if_of_an_orbit_that_the_run_lacks_is_fitted_without_another(page):
    store = page.session.store
    page.session.choices.order = 3
    end_job(page)
    before = len(store.requested)
    page.choose_orbit(1)
    end_job(page)
    assert len(store.requested) == before + 1
    assert (page.session.shown.orbit, page.session.shown.settings.order) == (1, 3)


def test_what_if_on_the_screen_is_listed_and_stays_once_it_has_a_name(page):
    session = page.session
    session.choices.order = 3
    end_job(page)
    label = "orbit 0: order 3 (what-if, on the screen)"
    assert labels(page)[0] == label
    assert SolutionList(page).load(entry(page, label)).settings.order == 3
    SolutionList(page).rename(entry(page, label), "low")
    assert labels(page)[0] == "orbit 0: low: order 3 (what-if)"
    assert not session.shown.is_replaceable
    session.choices.order = 2
    end_job(page)
    assert labels(page)[:2] == [
        "orbit 0: order 2 (what-if, on the screen)",
        "orbit 0: low: order 3 (what-if)",
    ]


def test_what_if_on_the_screen_that_an_earlier_page_has_listed_is_there_once(page):
    page.session.journal.rename(MadeSolution(0, FitSettings(order=3), is_what_if=True), "low")
    page.session.choices.order = 3
    end_job(page)
    assert page.session.shown.is_replaceable
    assert [label for label in labels(page) if "order 3" in label] == [
        "orbit 0: low: order 3 (what-if)"
    ]


def test_kept_solution_is_shown_and_is_in_the_address(page):
    before = page.session.shown
    page.session.open_listed(SolutionList(page).load(entry(page, labels(page)[1])))
    assert page.session.shown.kept == "old"
    assert page.session.other is before
    assert page.session.shown.label == "old: order 5"
    address = page.address()
    assert address["solution"] == "kept=old"
    page.choose_orbit(1)
    end_job(page)
    page.begin(address)
    end_job(page)
    assert page.session.shown.kept == "old"
    page.begin({"view": "orbit", "solution": "kept=gone"})
    assert "solution: expected the name of a kept solution, found 'gone'" in page.session.notice


def test_solution_of_the_session_is_shown_again_in_its_orbit(page):
    page.choose_orbit(1)
    end_job(page)
    found = SolutionList(page).load(entry(page, "orbit 0: order 4 (what-if)"))
    page.session.open_listed(found)
    assert (page.session.shown.orbit, page.session.shown.settings.order) == (0, 4)
    assert page.session.shown.is_what_if
    assert not page.session.shown.is_replaceable


def test_solution_that_the_store_has_lost_is_computed_again(page, monkeypatch):
    monkeypatch.setattr(page.session.store, "result", lambda *_: None)
    found = SolutionList(page).load(entry(page, "orbit 0: order 4 (what-if)"))
    assert found == Request(0, FitSettings(order=4), is_what_if=True)


def test_named_solution_is_there_again_after_a_reload(page):
    session = page.session
    session.journal.resume(KEY)
    session.journal.rename(session.journal.made[0], "lower")
    again = Session(session.store)
    assert again.journal.made == []
    again.journal.resume("../" + KEY)
    assert again.journal.made == []
    again.journal.resume(KEY)
    assert [(one.name, one.settings.order) for one in again.journal.made] == [("lower", 4)]


def test_what_was_made_before_the_browser_told_its_key_stays(page):
    store = page.session.store.made
    store.remember(KEY, MadeSolution(1, FitSettings(), is_what_if=False))
    page.session.journal.resume(KEY)
    assert [(one.orbit, one.settings.order) for one in store.of(KEY)] == [(1, 5), (0, 4)]


def test_run_and_kept_solutions_have_notes_and_are_on_disk_already(page):
    made, kept, run = map(lambda label: entry(page, label), labels(page))
    assert made.note_path is None
    assert kept.note_path.parent.name == "old"
    assert run.note_path.name == "note.txt"
    with pytest.raises(InputError, match="on disk already"):
        SolutionList(page).keep(kept, "again")


def test_damaged_kept_solution_is_listed_as_such_and_refused(page):
    kept = entry(page, labels(page)[1])
    (kept.what.directory / "result.json").write_text("{}")
    assert labels(page)[1] == "orbit 0: old: damaged (fit, kept)"
    with pytest.raises(InputError, match="result.json"):
        SolutionList(page).load(kept)


def test_other_orbits_of_the_run_are_offered_and_compared(page):
    (other,) = SolutionList(page).other_orbits()
    assert other.label == "orbit 1: default: order 5 (run)"
    with pytest.raises(InputError, match="run default: orbit 1 is gone"):
        SolutionList(page).load(other)


def test_comparison_that_was_chosen_stays_for_the_next_solutions(page):
    session = page.session
    chosen = SolutionList(page).load(entry(page, labels(page)[1]))
    session.compare_with(chosen)
    assert session.other is chosen
    session.choices.order = 3
    end_job(page)
    assert session.other is chosen
    session.exchange()
    assert session.shown is chosen
    assert session.other.settings.order == 3
    session.exchange()
    session.compare_with(None)
    assert session.other is session.fitted


def test_solutions_of_different_orbits_are_exchanged_with_their_orbits(page, fit_result):
    session = page.session
    shown = session.shown
    session.compare_with(shown._replace(orbit=1, run="default"))
    session.exchange()
    assert (session.shown.orbit, session.shown_part.orbit, session.other) == (1, 1, shown)
    session.exchange()
    assert (session.shown, session.shown_part.orbit) == (shown, 0)


def test_journal_is_bounded(monkeypatch):
    monkeypatch.setattr("plateviz.solving.made_solutions._MOST_OF_A_KEY", 2)
    monkeypatch.setattr("plateviz.solving.made_solutions._MOST_KEYS", 2)
    store = MadeSolutions()
    for orbit in range(3):
        store.remember(KEY, MadeSolution(orbit, FitSettings(), False, "x" * 1000))
    assert [one.orbit for one in store.of(KEY)] == [1, 2]
    assert {len(one.name) for one in store.of(KEY)} == {60}
    for last in "123":
        store.remember(KEY[:-1] + last, MadeSolution(0, FitSettings(), is_what_if=False))
    assert store.of(KEY) == []
    assert Journal(store).made == []
