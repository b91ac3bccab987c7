"""What a verdict says to do, tried from the Verdict workspace, with a fake store."""

from dataclasses import replace

import pytest

from plateviz.dashboard.session.remedies import remedies, try_settings
from plateviz.dashboard.views.panes.remedies import RemediesView
from plateviz.verdict.causes import Cause
from plateviz.verdict.verdict import Verdict
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from tests.plateviz.dashboard.fake_store import finish

DRIFT = FitSettings(drift=2)


def cause(*options, title="the distortion drifts"):
    return Cause("drift", title, "Evidence.", 43.2, "It spoils all.", "let it", options, True)


@pytest.mark.parametrize("options", [(), ("--drift 2",), ("--of-another-version 3",)])
def test_cause_without_a_change_of_settings_has_no_remedy(options):
    assert [one.settings for one in remedies(DRIFT, [cause(*options)])] == [None]


def test_remedy_is_tried_beside_the_fit(live):
    fitted = live.shown
    try_settings(live, DRIFT)
    (_, settings, job) = live.store.requested[-1]
    assert (settings, job.request["what_if"]) == (DRIFT, True)
    assert live.choices.drift == 2
    finish(live)
    assert live.shown.settings == DRIFT
    assert live.other is fitted
    n_requested = len(live.store.requested)
    try_settings(live, DRIFT)
    assert len(live.store.requested) == n_requested


def test_remedy_that_was_cancelled_is_tried_again(live):
    try_settings(live, DRIFT)
    live.job.take({"event": "cancelled"})
    live.poll()
    assert live.job is None
    try_settings(live, DRIFT)
    assert [one[1] for one in live.store.requested[-2:]] == [DRIFT, DRIFT]


def test_remedy_that_is_being_computed_goes_on(live):
    try_settings(live, DRIFT)
    job, n_requested = live.job, len(live.store.requested)
    try_settings(live, DRIFT)
    assert live.job is job
    live.refit()
    fit = live.job
    assert fit is not job
    live.refit()
    try_settings(live, DRIFT)
    assert live.job is fit
    assert len(live.store.requested) == n_requested + 1


@pytest.mark.parametrize("before", ["no what-ifs", "another fit runs", "another engine"])
def test_remedy_is_fitted_where_there_is_no_what_if(live, before):
    settings = DRIFT
    if before == "no what-ifs":
        live.choices.what_if_at_once = False
    elif before == "another fit runs":
        live.refit()
    else:
        settings = DRIFT.with_(engine="svi")
    try_settings(live, settings)
    (_, requested, job) = live.store.requested[-1]
    assert (requested, job.request["what_if"]) == (settings, False)


def judged(result, verdict):
    """A solution with a verdict that was made before."""
    found = replace(result)
    found.derived["verdict"] = verdict
    return found


def buttons(view):
    return [row[0] for row in view.__panel__() if row[0].visible]


def shown(view):
    return "".join(row[-1].object for row in view.__panel__())


def test_each_cause_has_a_row_and_each_remedy_a_button(live, fit_result):
    ids = [f"--exclude source={one}" for one in fit_result.sources["source_id"][:5]]
    causes = [cause("--drift 2"), cause(title="<b> is unknown"), cause(*ids)]
    verdict = Verdict("bad", "Not.", [], [], causes=causes)
    live.shown = live.shown._replace(result=judged(live.shown.result, verdict))
    view = RemediesView(live)
    assert len(view.__panel__()) == 3
    assert "<b>The distortion drifts</b>, 43 sigma. Let it. <code>--drift 2</code>" in shown(view)
    assert "&lt;b&gt; is unknown" in shown(view)
    assert f"<code>{ids[2]}</code> and 2 more" in shown(view)
    first, last = buttons(view)
    assert first.description.startswith("Try it: solve the orbit with --drift 2. ")
    last.clicks += 1
    left_out = Subset(sources=frozenset(fit_result.sources["source_id"][:5].tolist()))
    assert live.store.requested[-1][1].exclusions == left_out


def test_rows_follow_the_solution_on_the_screen(live):
    good, bad = Verdict("good", "", [], []), Verdict("bad", "", [], [], causes=[cause("--drift 2")])
    live.shown = live.shown._replace(result=judged(live.shown.result, bad))
    view = RemediesView(live)
    assert len(buttons(view)) == 1
    # The fit has the option now, which did not help.
    live.shown = live.shown._replace(settings=DRIFT)
    assert (len(view.__panel__()), buttons(view)) == (1, [])
    live.shown = live.shown._replace(result=judged(live.shown.result, good))
    assert not view.__panel__().visible


def test_rows_stay_faded_while_another_solution_of_the_orbit_is_judged(live):
    bad = Verdict("bad", "", [], [], causes=[cause("--drift 2")])
    worse = Verdict("bad", "", [], [], causes=[cause("--drift 3"), cause()])
    live.shown = live.shown._replace(result=judged(live.shown.result, bad))
    view, judge = RemediesView(live), live.store.judge
    (row,) = view.__panel__()
    judge.has_judged = lambda result: "verdict" in result.derived
    live.shown = live.shown._replace(result=replace(live.shown.result))
    assert list(view.__panel__()) == [row]
    assert (row[0].disabled, "'stale'" in row[1].object) == (True, True)
    # What was there takes the new words.
    live.shown = live.shown._replace(result=judged(live.shown.result, worse))
    assert [one is row for one in view.__panel__()] == [True, False]
    assert (row[0].disabled, "'stale'" in row[1].object) == (False, False)
    assert "--drift 3" in shown(view)
    # Those of another orbit would be wrong.
    live.shown = live.shown._replace(orbit=5, result=replace(live.shown.result))
    assert not view.__panel__().visible
