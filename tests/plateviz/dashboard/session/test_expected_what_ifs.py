"""What-ifs that the solver makes before a person asks for them, with a fake store."""

from dataclasses import replace

import pytest

from plateviz.dashboard.session.expected_what_ifs import ExpectedWhatIfs
from plateviz.dashboard.session.selection_actions import SelectionActions
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.controls.fit_controls import width_input
from solver.data.parameters import BY_NAME
from solver.data.settings import FitSettings
from tests.plateviz.dashboard.fake_store import FakeStore, finish
from tests.plateviz.dashboard.session.test_session import of_run


@pytest.fixture
def expected(live):
    return ExpectedWhatIfs(live)


def orders(expected):
    return [settings.order for settings in expected.settings()]


def test_next_orders_are_expected_up_to_that_of_the_fit(live, expected):
    assert orders(expected) == [4]
    live.choices.order = 4
    finish(live)
    live.choices.order = 3
    finish(live)
    assert orders(expected) == [2, 4]
    live.choices.order = 0
    finish(live)
    assert orders(expected) == [1]


def test_what_is_on_the_screen_or_listed_is_not_expected(live, expected):
    live.choices.order = 4
    finish(live)
    assert orders(expected) == [3]


def test_what_leaves_the_selection_out_is_what_is_expected_first(live, expected, fit_result):
    live.selection.select_sources(frozenset(fit_result.sources["source_id"].tolist()[:3]))
    assert [bool(one.exclusions) for one in expected.settings()] == [True, False]
    first = expected.settings()[0]
    SelectionActions(live).leave_out()
    assert live.store.requested[-1][1] == first
    finish(live)
    assert not any(
        one.exclusions == first.exclusions and one.order == 5 for one in expected.settings()
    )


def test_settings_that_are_invalid_or_of_another_engine_expect_nothing(live, expected):
    live.choices.what_if_at_once = False
    live.choices.engine = "svi"
    assert expected.settings() == []
    live.choices.load(FitSettings(order=5))
    live.choices.exclusions = "source=x"
    assert expected.settings() == []


def test_width_that_is_being_typed_is_what_is_expected_first(live, expected):
    entry = width_input(live.choices, BY_NAME["sources"])
    entry.value_input = "2.5"
    expected.ask()
    first, *_ = live.store.prepared[-1][2]
    assert live.store.prepared[-1][-1]
    assert first.prior_widths == {"sources": 2.5}
    assert live.store.requested[-1][1].prior_widths == {}
    entry.value_input = "2.5 m"
    assert not any(one.prior_widths for one in expected.settings())
    entry.value_input = entry.value = "2.5"
    assert live.choices.typed == {}
    assert live.store.requested[-1][1] == first


def test_width_that_is_shown_is_not_being_typed(live, expected):
    entry = width_input(live.choices, BY_NAME["sources"])
    before = entry.value
    entry.value_input = "7"
    entry.value_input = before
    assert live.choices.typed == {}
    assert not any(one.prior_widths for one in expected.settings())


def test_solver_is_asked_once_for_each_change(live, expected, fit_result):
    expected.ask()
    expected.ask_for_fit()
    assert live.store.prepared == [(0, FitSettings(order=5), expected.settings(), False, False)]
    live.selection.select_sources(frozenset(fit_result.sources["source_id"].tolist()[:1]))
    expected.ask()
    assert len(live.store.prepared) == 2


def test_orbit_of_a_run_is_fitted_once_the_page_is_at_rest(fit_result):
    session = Session(FakeStore(fit_result))
    expected = ExpectedWhatIfs(session)
    session.show_result(of_run(fit_result))
    expected.ask()
    assert session.store.prepared == []
    expected.ask_for_fit()
    expected.ask_for_fit()
    assert session.store.prepared == [(0, fit_result.settings, expected.settings(), True, False)]
    session.selection.select_exposures(frozenset({(0, 1)}))
    expected.ask()
    assert len(session.store.prepared) == 2
    session.show_result(of_run(replace(fit_result), 1))
    expected.ask()
    assert len(session.store.prepared) == 2


def test_nothing_is_asked_for_during_a_job_or_if_no_what_if_is_wanted(live, expected):
    live.refit()
    live.choices.order = 3
    live.refit()
    expected.ask_for_fit()
    finish(live)
    live.choices.what_if_at_once = False
    expected.ask_for_fit()
    assert live.store.prepared == []
