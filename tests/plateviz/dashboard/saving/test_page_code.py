"""The code of what is on the screen: run, it draws the figures of the page with their numbers."""

import shlex
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import plateviz
from plateviz.dashboard.navigation.navigation import View
from plateviz.dashboard.saving import page_code as module
from plateviz.dashboard.saving.page_code import page_code
from plateviz.dashboard.session.orbit_figures import chosen_of, figures_of
from plateviz.notebook.keywords import settings_with
from plateviz.notebook.solution import OpenSolution
from plateviz.plots.comparison.both_solutions import comparable_figures, figure_of_both
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.explore.explore import explored_figure
from plateviz.plots.workspace import OrbitWorkspace, SurveyWorkspace
from plateviz.reports.more_figures import MoreFigures, more_of_orbit
from plateviz.runs.explorable import COLUMNS_OF_RUN
from plateviz.tables.explore import EXPLORABLE
from solver.data.instrument import MINI_MOCK
from solver.data.settings import FitSettings
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun


@pytest.fixture
def solved(navigation, monkeypatch):
    """The page on its Orbit view; `plateviz.open` fits nothing, and gives what is on the screen."""
    navigation.turn_to(View.ORBIT)
    session = navigation.session
    known = [session.shown]

    def fit(**settings):
        made = settings_with(FitSettings(), settings)
        (found,) = [one for one in known if one.settings == made]
        return OpenSolution(found.result, MINI_MOCK, "sky", "here")

    survey = SimpleNamespace(orbit=lambda number: SimpleNamespace(fit=fit))
    monkeypatch.setattr(plateviz, "open", lambda path: survey)
    navigation.known = known
    return navigation


def drawn_by(code):
    """Run the Python of a page; return name -> figure."""
    namespace = {}
    exec(code.python, namespace)
    return {one.name: one for one in namespace.get("figures", [])}


def numbers(figure):
    return {
        (number, glyphs.name, column): np.hstack(list(values)) if len(values) else values
        for number, frame in enumerate(figure)
        for glyphs in frame.glyphs
        for column, values in glyphs.columns.items()
    }


def require_same(found, expected):
    found, expected = numbers(found), numbers(expected)
    assert found.keys() == expected.keys()
    assert expected
    for key, values in expected.items():
        np.testing.assert_array_equal(found[key], values, err_msg=str(key))


@pytest.mark.parametrize("workspace", [one for one in OrbitWorkspace if one.value != "explore"])
def test_python_draws_the_figures_of_the_workspace(solved, workspace):
    session = solved.session
    session.theme = "dark"
    session.shown_part.param.update(field="1", plates=(0, 1), detector="2")
    solved.turn_to_workspace(workspace)
    figures = drawn_by(page_code(solved))
    chosen = chosen_of(session)
    assert list(figures) == [
        one.name for one in figures_of(session, workspace) if one.has_data(chosen)
    ]
    for one in figures_of(session, workspace):
        if one.name in figures and (one.follows_shown or len(figures) == 1):
            require_same(figures[one.name]._plot(), one.plot(chosen))
        if one.name in figures:
            assert figures[one.name]._theme == "dark"


def test_compared_solution_is_made_too(solved, make_fit_result):
    session = solved.session
    fitted, settings = session.shown, FitSettings(order=3)
    what_if = fitted._replace(
        settings=settings, is_replaceable=True, is_what_if=True, result=make_fit_result(2)[0]
    )
    solved.known.append(what_if)
    session.param.update(shown=what_if, other=fitted)
    solved.turn_to_workspace(OrbitWorkspace.ORDERS)
    code = page_code(solved)
    figures = drawn_by(code)
    (comparison,) = [
        one for one in figures_of(session, OrbitWorkspace.ORDERS) if one.name == "comparison"
    ]
    chosen = chosen_of(session)
    require_same(figures["comparison"]._plot(), comparison.plot(chosen))
    both = {one.name: one for one in comparable_figures()}[session.figure_of_both]
    require_same(figures[both.name]._plot(), figure_of_both(both, chosen))
    assert "It is a what-if" in code.about
    assert "Without --orbits" in code.about
    command = code.command.replace("\\\n", "").replace(" --accept", "")
    made, other, report = command.splitlines()
    assert "--run reproduced --orbits 0   --order 3" in made
    assert other.startswith("plateviz survey sky --run reproduced-other --orbits 0")
    assert shlex.split(report)[2:8] == ["sky", "--run", "reproduced", "--orbit", "0", "--other"]
    assert shlex.split(report)[9:11] == ["--both", "residual-map"]
    # A comparison with another orbit is no report of one orbit.
    session.other = fitted._replace(orbit=1)
    code = page_code(solved)
    assert "--other" not in code.command
    assert "--both" not in code.command
    assert "other = plateviz.open('sky').orbit(1).fit()" in code.python
    assert "another orbit" in code.about


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"only": "n_obs", "lowest": 12.0, "has_median": True, "colour": "leverage"},
        {"x": "standardised", "is_log_x": True, "limits": ((0.1, 2.5), (-0.5, 1e-3 / 7.0))},
    ],
)
def test_explore_is_drawn_again(solved, changes):
    solved.turn_to_workspace(OrbitWorkspace.EXPLORE)
    assert page_code(solved).python.endswith(".fit()")
    result = solved.session.shown.result
    table = EXPLORABLE["measurements"](result)
    solved.exploration.offer(list(table.columns))
    solved.exploration.param.update(**changes)
    solved.exploration.param.update(selects="exposures")
    solved.session.theme = "dark"
    code = page_code(solved)
    expected = explored_figure(table, solved.exploration.columns())
    drawn = drawn_by(code)["explore"]
    assert drawn._theme == "dark"
    by_python = drawn._plot()
    assert (by_python[0].x, by_python[0].y) == (expected[0].x, expected[0].y)
    report = shlex.split(code.command.splitlines()[-1])
    texts = [report[report.index("--explore") + 1]]
    chosen = Chosen(result, MINI_MOCK)
    (figure,) = more_of_orbit(MoreFigures(explored=texts), chosen)
    in_report = figure.choices["All"]()
    require_same(in_report, by_python)
    # What a drag selects is of the page only.
    same = replace(solved.exploration.columns(), selects="sources")
    require_same(by_python, explored_figure(table, same))


def test_view_of_a_run_reads_the_run(navigation, survey):
    assert navigation.view is View.SURVEY
    code = page_code(navigation)
    assert code.command == "plateviz report sky --run default --survey -o REPORT.html"
    assert code.python.startswith(
        "import plateviz\n\nsurvey = plateviz.open('sky', run='default')\n"
    )
    assert "survey.figure('orbit-health')" in code.python
    navigation.turn_to_workspace(SurveyWorkspace.EXPLORE)
    assert "figures" not in page_code(navigation).python
    navigation.survey_exploration.offer(list(COLUMNS_OF_RUN["measurements"]))
    code = page_code(navigation)
    assert "\n    survey.explore('measurements', 'focal_x', 'residual_x'),\n" in code.python
    wanted = "'rows=measurements&x=focal_x&y=residual_x'"
    assert f"--survey --explore {wanted} -o REPORT.html" in code.command
    source = int(survey.history["source_id"].iloc[0])
    navigation.open_source(str(source))
    code = page_code(navigation)
    assert f"--source {source} -o" in code.command
    assert f"run='default').source({source})\nfigures = [\n    source.figure(" in code.python


def test_nothing_on_the_screen_has_no_code(navigation):
    navigation.turn_to(View.SOURCE)
    with pytest.raises(InputError, match="no source is shown yet"):
        page_code(navigation)


def test_name_of_a_run_with_other_settings_is_not_taken(solved, fit_result, survey):
    code = page_code(solved)
    assert "--run reproduced " in code.command
    assert " &&\nplateviz report" in code.command
    same = FakeRun("reproduced", survey, fit_result, solved.session.shown.settings)
    other = FakeRun("reproduced", survey, fit_result, FitSettings(order=2))
    solved.known_runs["reproduced"] = same
    assert page_code(solved).command == code.command
    solved.known_runs["reproduced"] = other
    expected = code.command.replace("--run reproduced ", "--run reproduced-2 ")
    assert page_code(solved).command == expected.replace("reproduced.html", "reproduced-2.html")


def test_command_of_a_solution_that_is_not_trusted_does_not_stop_before_the_report(
    solved, monkeypatch
):
    for state, is_accepted in (("warn", False), ("bad", True)):
        judged = SimpleNamespace(state=state)
        monkeypatch.setattr(module, "orbit_verdict", lambda _, judged=judged: judged)
        assert ("--accept" in page_code(solved).command) == is_accepted
