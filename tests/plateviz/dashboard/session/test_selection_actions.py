"""SelectionActions: leave out, put back, invert, keep and take up, with a fake store."""

import pytest

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.prior_widths import default_widths
from plateviz.dashboard.session.selection_actions import SelectionActions, look_for_kept
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.stage import Stage
from plateviz.dashboard.views.elements.notice import NoticeView
from plateviz.runs.kept_selections import KeptSelections
from solver.data.settings import FitSettings
from solver.data.subset import NOTHING, Subset
from solver.errors import InputError
from tests.plateviz.dashboard.fake_store import FakeStore, finish
from tests.plateviz.dashboard.fake_survey import SurveyStore


@pytest.fixture
def actions(live):
    return SelectionActions(live)


def ids_of(fit_result, n):
    return frozenset(fit_result.sources["source_id"].tolist()[:n])


def test_selection_is_left_out_and_put_back(live, actions, fit_result):
    ids = ids_of(fit_result, 2)
    live.selection.select_sources(ids | {-7})
    live.selection.select_exposures(frozenset({(0, 1), (99, 0)}))
    live.selection.select_detectors(frozenset({2}))
    measured = Subset(ids, frozenset({(0, 1)}), frozenset({2}))
    assert actions.in_orbit == measured
    assert not actions.is_left_out
    actions.leave_out()
    (_, settings, job) = live.store.requested[-1]
    assert settings.exclusions == measured
    assert job.request["what_if"]
    assert actions.is_left_out
    live.selection.select_detectors(frozenset({2, 3}))
    assert not actions.is_left_out
    live.selection.select_detectors(frozenset())
    actions.put_back()
    assert live.choices.settings().exclusions == Subset(detectors=frozenset({2}))


def test_what_is_left_out_already_stays_out(live, actions):
    live.choices.exclusions = "detector=1"
    live.selection.select_exposures(frozenset({(0, 1)}))
    actions.leave_out()
    assert live.choices.exclusions == "exposure=0/1, detector=1"
    actions.put_back()
    assert live.choices.exclusions == "detector=1"


def test_what_the_orbit_has_not_measured_is_not_left_out(live, actions):
    before = live.choices.settings()
    live.selection.select_sources(frozenset({-7}))
    live.selection.select_exposures(frozenset({(99, 0)}))
    assert not actions.is_left_out
    actions.leave_out()
    # No solution was asked for: that on the screen is still the requested one.
    assert live.stage is Stage.READY
    assert "measured nothing of the selection" in live.advice
    assert live.choices.settings() == before == FitSettings()
    live.selection.select_sources(frozenset({-8}))
    assert live.advice == ""


def test_invalid_settings_refuse_to_leave_out(live, actions, fit_result):
    live.choices.prior_widths = {**default_widths(), "detector_x": "-3"}
    live.selection.select_sources(ids_of(fit_result, 1))
    actions.leave_out()
    assert "detector_x" in live.message
    assert live.choices.exclusions == ""


def test_selected_kinds_are_inverted_among_what_is_measured(live, actions, fit_result):
    ids = frozenset(fit_result.sources["source_id"].tolist())
    live.selection.select_sources(ids_of(fit_result, 1))
    live.selection.select_detectors(frozenset({0, 3}))
    actions.invert()
    measured = frozenset(fit_result.residuals["detector_id"].tolist())
    assert live.selection.selected == Subset(
        ids - ids_of(fit_result, 1), frozenset(), measured - {0, 3}
    )
    actions.clear()
    assert live.selection.selected == NOTHING


def test_selection_is_kept_under_a_name_and_taken_up_again(live, actions):
    live.selection.select_exposures(frozenset({(0, 1)}))
    actions.keep(" corner ")
    live.selection.select_exposures(frozenset())
    live.selection.select_sources(frozenset({5}))
    actions.take_up("corner")
    assert live.selection.selected == Subset(exposures=frozenset({(0, 1)}))
    assert live.selection.name_of_selected == "corner"
    live.selection.select_detectors(frozenset({1}))
    assert live.selection.name_of_selected is None
    actions.keep("corner")
    assert live.selection.kept == {"corner": live.selection.selected}
    actions.forget("corner")
    actions.take_up("corner")
    assert live.selection.kept == {}
    assert live.selection.detectors == frozenset({1})


def test_kept_selection_is_there_for_others_and_after_a_reload(live, actions, fit_result, tmp_path):
    live.store.selections = KeptSelections(tmp_path / "solutions")
    corner = frozenset({(0, 1)})
    live.selection.select_exposures(corner)
    assert actions.keep("<b>corner</b>") == ""
    other = Session(FakeStore(fit_result))
    other.store.selections = KeptSelections(tmp_path / "solutions")
    others = SelectionActions(other)
    look_for_kept(other)
    assert other.selection.kept == {"<b>corner</b>": Subset(exposures=corner)}
    # The other one changes it; what the first has in mind under that name is another selection.
    other.selection.select_detectors(frozenset({2}))
    assert others.keep("<b>corner</b>") == ""
    live.selection.select_sources(frozenset({5}))
    with pytest.raises(InputError, match="somebody else has kept another selection"):
        actions.keep("<b>corner</b>")
    look_for_kept(live)
    assert live.selection.kept == other.selection.kept
    actions.keep("<b>corner</b>")
    # What somebody has changed in the meantime is not forgotten for all.
    others.forget("<b>corner</b>")
    assert KeptSelections(tmp_path / "solutions").all() == {
        "<b>corner</b>": Subset(frozenset({5}), corner)
    }
    actions.forget("<b>corner</b>")
    assert KeptSelections(tmp_path / "solutions").all() == {}


def test_address_of_a_large_kept_selection_is_opened_by_others(live, actions, fit_result, tmp_path):
    live.store.selections = KeptSelections(tmp_path / "solutions")
    corner = frozenset(range(100))
    live.selection.select_sources(corner)
    actions.keep("corner")
    pages = [Navigation(Session(SurveyStore(fit_result, []))) for _ in range(3)]
    for page in pages:
        page.session.store.selections = KeptSelections(tmp_path / "solutions")
    pages[0].begin(live.selection.address())
    assert (pages[0].session.selection.sources, pages[0].session.notice) == (corner, "")
    address = live.selection.address()
    live.selection.select_sources(frozenset(range(30)))
    actions.keep("corner")
    pages[1].begin(address)
    assert "something else is kept under 'corner'" in pages[1].session.notice
    actions.forget("corner")
    pages[2].begin(address)
    assert "nothing is kept under 'corner'" in pages[2].session.notice
    assert not any(page.session.selection.sources for page in pages[1:])


def test_selection_that_cannot_be_written_is_kept_in_the_session(live, actions, tmp_path):
    live.store.selections = KeptSelections(tmp_path / "solutions")
    live.selection.select_sources(frozenset(range(30_001)))
    assert "30,000 items" in actions.keep("all")
    assert list(live.selection.kept) == ["all"]
    (tmp_path / "solutions" / "selections.json").write_text("{", encoding="utf-8")
    live.selection.select_sources(frozenset({1}))
    assert "selections.json" in actions.keep("one")
    look_for_kept(live)
    assert "selections.json" in live.notice
    assert list(live.selection.kept) == ["one", "all"]


def test_nothing_and_too_much_is_not_kept(live, actions):
    with pytest.raises(InputError, match="nothing is selected"):
        actions.keep("empty")
    for number in range(50):
        live.selection.select_sources(frozenset({number}))
        actions.keep(f"{number}")
    with pytest.raises(InputError, match="50 selections are kept; forget one"):
        actions.keep("one more")
    actions.keep("49")
    assert len(live.selection.kept) == 50


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"engine": "svi"}, "press Fit: a solution with the engine svi has no what-if"),
        ({"what_if_at_once": False}, "press Fit, or switch on What-if at every change"),
    ],
    ids=["engine", "switch"],
)
def test_change_without_a_what_if_says_what_to_do_until_it_is_done(
    live, actions, fit_result, change, words
):
    live.choices.param.update(**change)
    notice, before = NoticeView(live).__panel__(), len(live.store.requested)
    live.selection.select_sources(ids_of(fit_result, 1))
    actions.leave_out()
    assert (len(live.store.requested), live.stage) == (before, Stage.READY)
    assert words in live.advice
    assert (notice[0].object, notice[0].severity) == (f"<p>{live.advice}</p>", "info")
    live.refit()
    assert (live.advice, len(notice)) == ("", 0)
    finish(live)
    actions.put_back()
    assert words in live.advice
    # As the solution on the screen was fitted.
    actions.leave_out()
    assert live.advice == ""


def test_change_during_a_fit_says_what_to_do(live, actions, fit_result):
    live.choices.what_if_at_once = False
    live.choices.order = 4
    live.refit()
    live.choices.what_if_at_once = True
    live.selection.select_sources(ids_of(fit_result, 1))
    actions.leave_out()
    assert "press Fit, which begins anew" in live.advice
    finish(live)
    assert live.advice
    live.refit()
    assert live.advice == ""


def test_change_with_a_what_if_says_nothing(live, actions, fit_result):
    live.selection.select_sources(ids_of(fit_result, 1))
    actions.leave_out()
    assert (live.advice, live.is_fitting) == ("", False)
