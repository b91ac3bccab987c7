"""The command line and the Python that make the solution and the figures on the screen again."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

from plateviz.dashboard.navigation.exploration import Exploration
from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.saving.as_code import (
    NAME,
    PREAMBLE,
    FigureCall,
    as_command,
    as_python,
    explored_as_python,
    figures_as_python,
    report_command,
    report_of_run,
)
from plateviz.dashboard.session.orbit_figures import chosen_of, figures_of
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.solution import Solution
from plateviz.dashboard.session.solution_address import run_settings
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.gallery import source_figures, survey_figures
from plateviz.plots.workspace import OrbitWorkspace, SurveyWorkspace, title_of
from plateviz.runs.run import Run
from plateviz.solving.origin import SurveyFolder
from plateviz.verdict.verdict import orbit_verdict
from solver.data.settings import FitSettings
from solver.errors import InputError

_OF_WHAT_IF = (
    "It is a what-if: the positions of a fit agree with it to a thousandth of their uncertainties."
)
_OF_ONE_ORBIT = "Without --orbits, the command fits all orbits of the survey."
_OF_OTHER_ORBIT = "The report does not compare with another orbit; the Python does."


class PageCode(NamedTuple):
    """What makes the screen again.

    Attributes
    ----------
    about : what it makes, and what it does not
    command : lines of a shell
    python : lines of Python
    """

    about: str
    command: str
    python: str


def page_code(navigation: Navigation) -> PageCode:
    """Return the code of the view on the screen.

    Raises
    ------
    InputError
        If the view shows nothing yet.
    """
    if navigation.view is View.ORBIT:
        return _of_solution(navigation)
    run = navigation.run
    if run is None:
        raise InputError(navigation.why_no_run.rstrip("."))
    if navigation.view is View.SURVEY:
        return _of_survey(navigation, run)
    found = navigation.found
    if found is None:
        raise InputError("no source is shown yet; choose one first")
    theme = _keywords(navigation.session, None)
    workspace, number = navigation.workspace, found.source_id
    calls = [(one.name, theme) for one in source_figures() if one.workspace is workspace]
    source = f".source({number})"
    return _of_run(navigation, run, calls, "source", source, "--source", str(number))


def _of_solution(navigation: Navigation) -> PageCode:
    session, workspace = navigation.session, navigation.orbit_workspace
    chosen, shown = chosen_of(session), session.shown
    if chosen is None or shown is None:
        raise InputError("no solution is shown yet")
    other = session.other if workspace is OrbitWorkspace.ORDERS else None
    origin, drawn = session.store.origin, _drawn_of_solution(navigation, chosen, other)
    python = [as_python(origin, shown.orbit, shown.settings)]
    if other is not None:
        code = as_python(origin, other.orbit, other.settings, "other").removeprefix(PREAMBLE)
        python += [code, "solution = solution.compared_with(other)"]
    python += [drawn] if drawn else []
    words = [_about(navigation, f"the solution ({shown.settings.describe()})", drawn)]
    words += [_OF_WHAT_IF] if _is_what_if(shown, other) else []
    words += [_OF_ONE_ORBIT] if isinstance(origin, SurveyFolder) else []
    words += [_OF_OTHER_ORBIT] if other is not None and other.orbit != shown.orbit else []
    commands = _commands(navigation, shown, other)
    return PageCode(" ".join(words), " &&\n".join(commands), "\n".join(python))


def _drawn_of_solution(navigation: Navigation, chosen: Chosen, other: Solution | None) -> str:
    """Return Python that draws what the workspace shows; `other` if it compares two solutions."""
    session, workspace = navigation.session, navigation.orbit_workspace
    if workspace is OrbitWorkspace.EXPLORE:
        return _explored_as_python(navigation.exploration, "solution", session)
    calls: list[FigureCall] = [
        (one.name, _keywords(session, chosen if one.follows_shown else None))
        for one in figures_of(session, workspace)
        if one.has_data(chosen)
    ]
    if other is not None:
        calls.insert(0, (session.figure_of_both, {"both": True, **_keywords(session, chosen)}))
    return figures_as_python("solution", calls)


def _commands(navigation: Navigation, shown: Solution, other: Solution | None) -> list[str]:
    """Return the command lines that make the solutions and the report.

    The other solution is made if it is of the same orbit: a report compares no other.
    """
    session, origin = navigation.session, navigation.session.store.origin
    made = _free_name(navigation, NAME, shown.settings)
    commands = [as_command(origin, shown.orbit, shown.settings, made, _is_distrusted(shown))]
    second, more = None, list[str]()
    if navigation.orbit_workspace is OrbitWorkspace.EXPLORE:
        more = _explored(navigation.exploration)
    if other is not None and other.orbit == shown.orbit:
        second = _free_name(navigation, f"{NAME}-other", other.settings)
        accept = _is_distrusted(other)
        commands.append(as_command(origin, other.orbit, other.settings, second, accept))
        more = ["--both", session.figure_of_both]
    return [*commands, report_command(origin, shown.orbit, second, more, made)]


def _is_distrusted(solution: Solution) -> bool:
    """Return whether the command that makes a solution would end as if it had failed."""
    return orbit_verdict(solution.result).state == "bad"


def _free_name(navigation: Navigation, name: str, settings: FitSettings) -> str:
    """Return a name for a run that no run with other settings has."""
    runs = navigation.known_runs
    runs.look()
    names = itertools.chain([name], (f"{name}-{number}" for number in itertools.count(2)))
    return next(one for one in names if one not in runs or _has_settings(runs[one], settings))


def _has_settings(run: Run, settings: FitSettings) -> bool:
    try:
        return run_settings(run) == settings
    except InputError:
        return False


def _of_survey(navigation: Navigation, run: Run) -> PageCode:
    workspace, theme = navigation.workspace, _keywords(navigation.session, None)
    figures = [one for one in survey_figures() if one.workspace is workspace]
    calls: list[FigureCall] = [(one.name, theme) for one in figures]
    if workspace is not SurveyWorkspace.COMPARE:
        return _of_run(navigation, run, calls, "survey", "", "--survey")
    comparison = navigation.session.run_comparison
    other = comparison.run(run.name, navigation.known_runs)
    if other is None:
        return _of_run(navigation, run, [], "survey", "", "--survey")
    calls.insert(0, (comparison.figure, {"both": True, **theme}))
    compared = f".compared_with({other.name!r})"
    options = ("--survey", "--other", other.name, "--both", comparison.figure)
    return _of_run(navigation, run, calls, "survey", compared, *options)


def _of_run(
    navigation: Navigation,
    run: Run,
    calls: Sequence[FigureCall],
    variable: str,
    call: str,
    *options: str,
) -> PageCode:
    survey = str(run.survey)
    opened = f"{PREAMBLE}{variable} = plateviz.open({survey!r}, run={run.name!r}){call}"
    figures = figures_as_python(variable, calls)
    if navigation.workspace is SurveyWorkspace.EXPLORE:
        exploration = navigation.survey_exploration
        options = (*options, *_explored(exploration))
        figures = _explored_as_python(exploration, variable, navigation.session)
    python = "\n".join(filter(None, [opened, figures]))
    about = _about(navigation, f"what is shown of run {run.name}", figures)
    return PageCode(about, report_of_run(survey, run.name, *options), python)


def _explored(exploration: Exploration) -> list[str]:
    """Return the options of a report that draws what Explore draws; none before it does."""
    return [part for text in exploration.texts() for part in ("--explore", text)]


def _explored_as_python(exploration: Exploration, variable: str, session: Session) -> str:
    if exploration.x is None:
        return ""
    columns = exploration.columns()
    return explored_as_python(variable, exploration.table, columns, session.theme)


def _about(navigation: Navigation, what: str, drawn: str) -> str:
    title = title_of(navigation.workspace)
    figures = f" and the figures of {title}, each in its own unit" if drawn else ""
    return f"These make {what} on the screen again{figures}. The report has all figures."


def _is_what_if(shown: Solution, other: Solution | None) -> bool:
    return shown.is_what_if or (other is not None and other.is_what_if)


def _keywords(session: Session, chosen: Chosen | None) -> dict[str, object]:
    """Return the keywords of a figure; `chosen` if it depends on the shown exposures."""
    theme: dict[str, object] = {} if session.theme == "light" else {"theme": session.theme}
    if chosen is None:
        return theme
    keywords: dict[str, object] = {}
    if len(chosen.exposures) < len(chosen.result.exposures):
        keywords["exposures"] = list(chosen.exposures)
    if chosen.detector is not None:
        keywords["detector"] = chosen.detector
    return keywords | theme
