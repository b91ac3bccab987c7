"""SolutionDialog: what somebody writes stays until it is saved."""

import pytest

from plateviz.dashboard.session.solution import Solution
from plateviz.dashboard.views.dialogs.solution_dialog import SolutionDialog
from plateviz.runs.kept_solutions import KeptSolutions
from plateviz.runs.note import read_note, write_note
from plateviz.solving.made_solutions import MadeSolution
from solver.data.settings import FitSettings


@pytest.fixture
def page(navigation, run, tmp_path, fit_result):
    """A page with the orbit of a run, whose store has one kept solution."""
    navigation.session.store.kept = KeptSolutions(tmp_path / "solutions")
    navigation.session.store.kept.keep("old", 0, False, fit_result)
    run.directory = tmp_path
    navigation.open_orbit(0)
    return navigation


@pytest.fixture
def window(page):
    made = SolutionDialog(page)
    made.open()
    choose(made, "old")
    return made


def choose(window, name):
    (entry,) = (one for one in window._choice.options.values() if one.name == name)
    window._choice.value = entry


def choose_made(window):
    """Choose a solution of the session."""
    made = [one for one in window._choice.options.values() if isinstance(one.what, MadeSolution)]
    window._choice.value = made[0]


def write(window, text):
    window._text.param.update(value=text, value_input=text)


def test_note_that_is_not_saved_stays_while_the_list_is_filled_again(page, window):
    write(window, "half a sentence")
    page.session.journal.param.trigger("made")
    page.session.param.trigger("shown")
    assert (window._text.value, window._text.label) == ("half a sentence", "Note (not saved)")
    window._save_note()
    path = window._chosen.note_path
    assert (read_note(path).text, window._text.label) == ("half a sentence", "Note")
    # What is saved is read again.
    write_note(path, "theirs", read_note(path).version)
    page.session.journal.param.trigger("made")
    assert window._text.value == "theirs"


def test_fast_clicks_keep_a_solution_once(page, window, fit_result):
    store = page.session.store
    store.keep = lambda made, name: store.kept.keep(name, made.orbit, False, fit_result)
    page.session.show_result(Solution(0, FitSettings(order=3), fit_result))
    window.open()
    choose_made(window)
    window._name.value = "mine"
    for clicks in range(1, 7):
        window._keep.clicks = clicks
    assert [one.name for one in store.kept.all()] == ["mine", "old"]
    assert window._message.severity == "success"
    assert window._message.object == "<p>It is kept on disk as mine.</p>"


def test_a_solution_stays_chosen_when_it_gets_another_name(page, window, fit_result):
    for order in (3, 4):
        page.session.show_result(Solution(0, FitSettings(order=order), fit_result))
    window.open()
    first, second = (
        one for one in window._choice.options.values() if isinstance(one.what, MadeSolution)
    )
    # The one further down in the list: without a choice, the list begins with the first.
    window._choice.value = second
    for name in ("mine", "yours"):
        window._name.value = name
        window._rename.clicks += 1
        assert window._chosen.what == second.what._replace(name=name)
    assert first.what in [one.what for one in window._choice.options.values()]


def test_typed_characters_are_kept_before_the_browser_has_left_the_field(page, window):
    window._text.value_input = "half"
    page.session.journal.param.trigger("made")
    assert window._text.value_input == "half"
    choose(window, "default")
    assert (window._text.value_input, window._text.label) == ("", "Note")
    choose(window, "old")
    assert window._text.value_input == "half"


def test_each_entry_keeps_the_note_that_was_written_for_it(window):
    write(window, "of the kept one")
    choose(window, "default")
    assert (window._text.value, window._text.label) == ("", "Note")
    write(window, "of the run")
    choose(window, "old")
    assert (window._text.value, window._text.label) == ("of the kept one", "Note (not saved)")
    window._save_note()
    choose(window, "default")
    assert (window._text.value, window._text.label) == ("of the run", "Note (not saved)")
    choose(window, "old")
    assert (window._text.value, window._text.label) == ("of the kept one", "Note")


def test_note_of_somebody_else_stays_beside_what_is_not_saved(page, window):
    write(window, "mine")
    path = window._chosen.note_path
    write_note(path, "theirs", read_note(path).version)
    choose(window, "default")
    choose(window, "old")
    window._save_note()
    assert (window._theirs.visible, window._theirs.value) == (True, "theirs")
    page.session.journal.param.trigger("made")
    assert (window._text.value, window._theirs.visible) == ("mine", True)
    choose(window, "default")
    assert not window._theirs.visible
    choose(window, "old")
    assert (window._text.value, window._theirs.value) == ("mine", "theirs")
    assert window._theirs.visible
    window._save_note()
    assert read_note(path).text == "mine"
    assert not window._theirs.visible


def test_note_that_cannot_be_read_shows_no_other_note(window):
    write(window, "mine")
    (entry,) = (one for one in window._choice.options.values() if one.name == "default")
    entry.note_path.write_bytes(b"\xff\xfe")
    choose(window, "default")
    assert window._message.visible
    assert not window._text.visible
    choose(window, "old")
    assert window._text.value == "mine"


def test_name_that_is_written_stays_while_the_list_is_filled_again(page, window):
    window._name.value = "half"
    page.session.journal.param.trigger("made")
    assert window._name.value == "half"


def test_name_that_no_kept_solution_can_have_is_refused_while_it_is_typed(window):
    window._name.value_input = "é"
    assert window._name.error_state
    assert window._name.helper_text.startswith("To be kept on disk: expected a name of up to 60")
    window._name.value_input = "e"
    assert (window._name.error_state, window._name.helper_text) == (False, "")


def test_kept_solution_is_shown_by_its_name_and_said_to_be_kept(
    page, window, monkeypatch, fit_result
):
    kept = page.session.store.kept
    monkeypatch.setattr(window._list, "keep", lambda _, name: kept.keep(name, 0, False, fit_result))
    window._name.value = " new "
    window._keep_on_disk()
    assert window._chosen.name == "new"
    assert window._message.object == "<p>It is kept on disk as new.</p>"


def test_name_that_turns_what_follows_is_refused_and_told(page, window, fit_result):
    page.session.show_result(Solution(0, FitSettings(order=3), fit_result))
    window.open()
    choose_made(window)
    window._name.value = "mine"
    window._give_name()
    window._name.value = "\u202eyours"
    window._give_name()
    assert [one.name for one in page.session.journal.made] == ["mine"]
    assert (window._message.visible, "that can be seen" in window._message.object) == (True, True)
    window._name.value = "אבג <b>"
    window._give_name()
    assert [one.name for one in page.session.journal.made] == ["אבג <b>"]
    assert not window._message.visible
