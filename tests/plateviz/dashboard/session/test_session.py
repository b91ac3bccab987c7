"""Session: its rules, with a fake store whose jobs are ended by the test."""

import pytest

from plateviz.dashboard.session.fit_choices import ANSWERED_AT_ONCE, CONTROLS, FitChoices
from plateviz.dashboard.session.prior_widths import default_widths
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.solution import Request, Solution
from plateviz.dashboard.session.stage import Stage
from solver.data.settings import SETTINGS, FitSettings
from solver.errors import InputError
from tests.plateviz.dashboard.fake_store import FakeStore, finish


@pytest.fixture
def session(fit_result):
    made = Session(FakeStore(fit_result))
    made.choices.what_if_at_once = False
    made.show_orbit(0)
    return made


@pytest.fixture
def live(session):
    """A session with a solution on the screen, which shows a what-if at every change."""
    finish(session)
    session.choices.what_if_at_once = True
    return session


def of_run(result, orbit=0):
    return Solution(orbit, result.settings, result, run="default")


def test_first_orbit_is_requested_with_the_settings_of_the_paper(session):
    assert session.stage is Stage.LOADING
    assert session.store.requested[0][:2] == (0, FitSettings())
    finish(session)
    assert session.stage is Stage.READY
    assert session.shown.settings == FitSettings()
    assert session.other is None


def test_preparations_for_an_orbit_are_given_up_when_it_is_left(fit_result):
    session = Session(FakeStore(fit_result))
    session.show_result(of_run(fit_result))
    session.show_orbit(0, FitSettings(order=2))
    assert session.store.left == []
    session.show_result(of_run(fit_result, 1))
    assert session.store.left == [0]


def test_solution_that_is_there_already_is_shown_without_a_change_before(session):
    """Otherwise all figures would be faded for a moment."""
    finish(session)
    stages = []
    session.param.watch(lambda event: stages.append(event.new), "stage")
    made = session.store.request

    def done(*arguments, **options):
        job = made(*arguments, **options)
        job.take({"event": "done"})
        return job

    session.store.request = done
    session.choices.order = 3
    session.refit()
    assert session.shown.settings.order == 3
    assert set(stages) == {Stage.READY}


def test_last_solution_stays_until_the_next_one_is_complete(session):
    finish(session)
    before = session.shown
    session.choices.order = 3
    session.refit()
    assert session.stage is Stage.STALE
    assert session.shown is before
    session.poll()
    assert session.shown is before
    finish(session)
    assert session.shown.settings.order == 3
    assert session.other is before
    assert len(session.solutions) == 2


def test_cancelled_refit_leaves_the_last_solution(session):
    finish(session)
    before = session.shown
    session.choices.order = 3
    session.refit()
    session.cancel()
    session.poll()
    assert session.shown is before
    assert session.stage is Stage.FAILED
    assert "cancelled" in session.message
    assert session.job is None


def test_fit_that_another_page_waits_for_is_given_up_here_only(session):
    session.store.is_shared = True
    job = session.job
    session.cancel()
    assert (session.job, session.stage) == (None, Stage.FAILED)
    assert "Another page waits" in session.message
    assert not job.status.is_over


def test_closed_page_leaves_its_fit_to_others(session):
    job = session.job
    session.close()
    assert (session.store.abandoned, session.store.cancelled) == ([job], [])
    session.close()
    assert session.store.abandoned == [job]


def test_failed_refit_has_a_message_and_leaves_the_last_solution(session):
    finish(session)
    before = session.shown
    session.refit()
    session.job.take({"event": "failed", "message": "no reference star"})
    session.poll()
    assert session.shown is before
    assert session.message == "no reference star"


def test_invalid_prior_requests_nothing(session):
    finish(session)
    session.choices.prior_widths = {**session.choices.prior_widths, "distortion_x": "wide"}
    session.refit()
    assert session.stage is Stage.FAILED
    assert "distortion_x" in session.message
    assert len(session.store.requested) == 1


def test_new_request_cancels_the_running_one_unless_it_is_the_same(session):
    first = session.job
    session.refit()
    assert session.job is first
    session.choices.order = 3
    session.refit()
    assert session.store.cancelled == [first]


def test_progress_is_shown_as_text(session):
    report = {"event": "progress", "stage": "iteration 2", "largest_step": 7.14}
    session.job.take(report)
    session.poll()
    assert session.message.startswith("iteration 2, largest step 7.1 sigma")
    session.job.take({**report, "stage": "iteration 0", "largest_step": float("nan")})
    session.poll()
    assert session.message.startswith("iteration 0 (")


def test_earlier_solution_is_compared_with_the_later(session):
    finish(session)
    session.choices.order = 3
    session.refit()
    finish(session)
    newer, older = session.shown, session.other
    session.bring_up(older)
    assert (session.shown, session.other) == (older, newer)
    assert session.choices.order == 5


def test_change_requests_a_what_if(live):
    first = live.shown
    live.choices.order = 4
    assert live.stage is Stage.STALE
    assert live.job.request["what_if"]
    finish(live)
    assert (live.shown.settings.order, live.shown.is_replaceable) == (4, True)
    assert live.shown.label == "what if: order 4"
    assert live.other is first
    assert live.solutions == [first]


def test_simultaneous_changes_are_one_what_if(live):
    requested = len(live.store.requested)
    live.choices.load(FitSettings(order=4, aberration=False))
    assert [s for _, s, _ in live.store.requested[requested:]] == [
        FitSettings(order=4, aberration=False)
    ]


def test_next_what_if_is_compared_with_the_fit(live):
    first = live.shown
    for order in (4, 3):
        live.choices.order = order
        finish(live)
    assert (live.shown.settings.order, live.other) == (3, first)


def test_only_the_last_change_during_a_what_if_is_requested(live):
    live.choices.order = 4
    for order in (3, 2, 1):
        live.choices.order = order
    finish(live)
    finish(live)
    assert [settings.order for _, settings, _ in live.store.requested] == [5, 4, 1]
    assert live.store.cancelled == []
    assert live.job is None


def test_reverted_change_returns_to_the_fit(live):
    first = live.shown
    live.choices.order = 4
    finish(live)
    live.choices.order = 5
    assert (live.shown, live.other, live.job) == (first, None, None)


def test_what_if_can_be_listed(live):
    live.choices.order = 4
    finish(live)
    live.list_what_if()
    assert not live.shown.is_replaceable
    assert [s.settings.order for s in live.solutions] == [5, 4]
    live.choices.order = 3
    finish(live)
    assert live.other.settings.order == 4


def test_fit_replaces_a_what_if(live):
    first = live.shown
    live.choices.order = 4
    finish(live)
    live.refit()
    assert not live.job.request["what_if"]
    finish(live)
    assert (live.shown.is_replaceable, live.other) == (False, first)
    assert len(live.solutions) == 2


def test_cancelled_what_if_drops_the_waiting_one(live):
    live.choices.order = 4
    live.choices.order = 3
    live.cancel()
    live.poll()
    assert live.job is None
    assert len(live.store.requested) == 2


def test_slow_engine_requests_no_what_if(live):
    live.choices.engine = "svi"
    live.choices.order = 4
    assert live.job is None


def test_invalid_change_is_reported_at_once(live):
    live.choices.exclusions = "detector 1"
    assert live.stage is Stage.FAILED
    assert "expected source=ID" in live.message
    assert live.job is None


@pytest.mark.parametrize(
    ("changes", "kept"),
    [({"order": 4}, True), ({"order": 4, "aberration": False}, False)],
    ids=["order-alone", "more"],
)
def test_what_if_keeps_a_comparison_of_orders_that_is_still_valid(session, changes, kept):
    session.choices.compare_orders = True
    session.refit()
    finish(session)
    session.choices.param.update(what_if_at_once=True, **changes)
    settings = session.store.requested[-1][1]
    assert settings == FitSettings(**changes, compare_orders=kept)


def test_comparison_of_orders_waits_for_a_fit(live):
    live.choices.compare_orders = True
    assert live.job is None
    live.choices.order = 4
    assert not live.store.requested[-1][1].compare_orders
    live.refit()
    assert live.store.requested[-1][1] == FitSettings(order=4, compare_orders=True)


def test_exclusions_are_parsed_and_shown_again(session):
    session.choices.exclusions = "detector=1, exposure=0/3 source=77"
    settings = session.choices.settings()
    assert settings.exclusions.names() == ["source 77", "exposure 0/3", "detector 1"]
    session.choices.load(settings)
    assert session.choices.settings() == settings


def test_another_orbit_removes_the_solutions(session):
    finish(session)
    session.show_orbit(1)
    assert session.solutions == []
    assert session.store.requested[-1][:2] == (1, FitSettings())
    finish(session)
    assert session.other is None


@pytest.mark.parametrize("order", [-1, 10, 3.5])
def test_order_is_bounded_on_the_server(order):
    with pytest.raises(ValueError, match="order"):
        FitChoices(order=order)


def test_settings_of_the_controls_have_only_the_changed_priors():
    choices = FitChoices()
    assert choices.settings() == FitSettings()
    choices.prior_widths = {**default_widths(), "pointing_ra": "1 arcmin", "pitch_x": "flat"}
    assert choices.settings().prior_widths == {"pointing_ra": 60.0, "pitch_x": float("inf")}
    choices.prior_shifts = "detector_x[2]=-5um, focal_length=0.1mm"
    assert choices.settings().prior_shifts == {"detector_x[2]": -5.0, "focal_length": 100.0}
    choices.compare_orders = True
    assert choices.settings().compare_orders
    again = FitChoices()
    again.load(choices.settings())
    assert again.settings() == choices.settings()


def test_invalid_control_is_named():
    choices = FitChoices()
    choices.prior_widths = {**default_widths(), "detector_x": "-3"}
    with pytest.raises(InputError, match="detector_x"):
        choices.settings()


def test_description_has_what_differs_from_the_paper():
    assert FitSettings().describe() == "order 5"
    changed = FitSettings(order=3, aberration=False, prior_widths={"distortion_x": 0.5})
    assert changed.describe() == "order 3, no aberration, distortion_x 0.5 um"
    assert FitSettings(compare_orders=True).describe() == "order 5, orders compared"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("order", 4),
        ("aberration", False),
        ("robust", True),
        ("prior_shifts", "detector_x[2]=-5um"),
        ("prior_widths", {**default_widths(), "pitch_x": "flat"}),
        ("exclusions", "detector=1"),
    ],
)
def test_change_of_any_control_answered_at_once_requests_a_what_if(live, name, value):
    assert name in ANSWERED_AT_ONCE
    setattr(live.choices, name, value)
    assert live.job.request["what_if"]
    assert live.store.requested[-1][1] == live.choices.settings()


def test_every_setting_with_a_control_is_a_parameter():
    controls = {name for name, one in SETTINGS.items() if one.control}
    others = {"name", "what_if_at_once", "typed"}
    assert controls == set(CONTROLS) == set(FitChoices.param) - others
    assert set(ANSWERED_AT_ONCE) == controls - {"engine", "compare_orders"}


def test_what_if_after_a_solution_was_opened_is_not_what_is_opened(live):
    live.open(Request(1, FitSettings(order=4)))
    assert live.is_opening
    finish(live)
    assert not live.is_opening
    live.choices.order = 3
    assert live.job is not None
    assert not live.is_opening
