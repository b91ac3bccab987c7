"""Two runs of a survey in a notebook: what differs, and figures of both."""

import pytest

from plateviz.notebook import runs
from plateviz.notebook import survey as notebook_survey
from plateviz.notebook.survey import OpenSurvey
from plateviz.tables.survey_tables import SurveyTables
from solver.data.settings import FitSettings
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun


@pytest.fixture
def opened(made_survey, survey, fit_result, monkeypatch):
    """A survey with two runs."""
    known = {
        "default": FakeRun("default", survey, fit_result),
        "low": FakeRun("low", survey, fit_result, FitSettings(order=3)),
    }

    def open_run(directory, name):
        if name not in known:
            raise InputError(f"expected a run {name!r}")
        return known[name]

    def tables(run):
        return SurveyTables(run.orbits(), run.motions(), survey.catalogue, survey.truth)

    monkeypatch.setattr(notebook_survey, "open_run", open_run)
    monkeypatch.setattr(runs, "survey_tables", tables)
    return OpenSurvey(made_survey, "default")


def test_changes_are_those_of_the_workspace(opened):
    two = opened.compared_with("low")
    rows = two.changes.set_index("what")
    assert rows.loc["Run"].tolist() == ["low", "default", ""]
    assert rows.loc["Distortion order"].tolist() == ["order 3", "order 5", ""]
    # The survey itself is as it was.
    assert (opened.other_name, two.run_name, two.other_name) == (None, "default", "low")


def test_figures_of_two_runs_need_two(opened):
    two = opened.compared_with("low")
    assert "motion-differences" not in opened.figures
    assert two.figure("motion-differences")._plot().message is None
    both = two.figure("orbit-health", both=True)
    assert both.title == "Both runs: Health of the orbits"
    assert len(both._plot()) == 2 * len(opened.figure("orbit-health")._plot())
    with pytest.raises(InputError, match="expected a figure out of"):
        two.figure("sky-distribution", both=True)
    for ask in (lambda: opened.changes, lambda: opened.figure("orbit-health", both=True)):
        with pytest.raises(InputError, match="expected a run to compare with, found none"):
            ask()


@pytest.mark.parametrize(
    ("name", "message"),
    [("default", "expected another run than 'default'"), ("third", "expected a run 'third'")],
)
def test_run_that_is_none_to_compare_with_is_refused(opened, name, message):
    with pytest.raises(InputError, match=message):
        opened.compared_with(name)
    assert opened.other_name is None
