"""The report of what is on the screen: a solution, a source or a run, as one HTML file."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from plateviz.dashboard.navigation.navigation import FoundSource, Navigation, View
from plateviz.dashboard.saving.as_code import as_command, report_of_run
from plateviz.dashboard.saving.downloads import Download, Later, Progress, file_name
from plateviz.dashboard.session.solution import Solution
from plateviz.plots.workspace import OrbitWorkspace, SurveyWorkspace
from plateviz.reports.facts import facts_of
from plateviz.reports.more_figures import NO_MORE, MoreFigures
from plateviz.reports.orbit import orbit_report
from plateviz.reports.page import page_of
from plateviz.reports.report import Facts, Report
from plateviz.reports.survey import source_report, survey_report
from plateviz.runs.run import Run
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.turns import Turns
from solver.errors import InputError
from solver.io.result_instrument import instrument_of

_SOLUTION, _OTHER = "Solution", "Compared with solution"


def page_report(navigation: Navigation) -> Later:
    """Return the report of the view on the screen as it is now; a thread makes it in its turn.

    Raises
    ------
    InputError
        If the view shows nothing yet.
    """
    if navigation.view is View.ORBIT:
        return _of_solution(navigation)
    run, turns = navigation.run, navigation.session.store.reports
    if run is None:
        raise InputError(navigation.why_no_run.rstrip("."))
    if navigation.view is View.SURVEY:
        make = partial(_survey, run, _other_run(navigation), _on_screen(navigation))
        return _later(f"run-{run.name}", make, turns)
    found = navigation.found
    if found is None:
        raise InputError("no source is shown yet; choose one first")
    return _later(f"source-{found.source_id}", partial(_source, run, found), turns)


def _on_screen(navigation: Navigation) -> MoreFigures:
    """Return the figures on the screen that reports do not have by themselves."""
    session, workspace = navigation.session, navigation.workspace
    if workspace in (OrbitWorkspace.EXPLORE, SurveyWorkspace.EXPLORE):
        is_of_orbit = workspace is OrbitWorkspace.EXPLORE
        shown = navigation.exploration if is_of_orbit else navigation.survey_exploration
        return MoreFigures(explored=shown.texts())
    if workspace is OrbitWorkspace.ORDERS and session.other is not None:
        return MoreFigures(both=[session.figure_of_both])
    if _other_run(navigation) is not None:
        return MoreFigures(both=[session.run_comparison.figure])
    return NO_MORE


def _other_run(navigation: Navigation) -> Run | None:
    """Return the run that is compared with, if it is on the screen."""
    if navigation.workspace is not SurveyWorkspace.COMPARE:
        return None
    return navigation.session.run_comparison.run(navigation.run_name, navigation.known_runs)


def _of_solution(navigation: Navigation) -> Later:
    session = navigation.session
    shown, other = session.shown, session.other
    if shown is None:
        raise InputError("no solution is shown yet")
    facts = facts_of(as_command(session.store.origin, shown.orbit, shown.settings))
    facts["Report"][_SOLUTION] = session.journal.label(shown)
    if other is not None:
        facts["Report"][_OTHER] = session.journal.label(other)
    make = partial(_solution, shown, other, session.store, facts, _on_screen(navigation))
    stem = session.shown_part.subject() + ("-what-if" if shown.is_replaceable else "")
    return _later(stem, make, session.store.reports)


def _later(stem: str, compose: Callable[[], Report], turns: Turns) -> Later:
    def make(progress: Progress) -> Download:
        page = page_of(compose(), progress)
        return Download(file_name(f"{stem}-report", ".html"), page.encode())

    return Later(make, turns)


def _solution(
    shown: Solution,
    other: Solution | None,
    store: SolutionStore,
    facts: Facts,
    more: MoreFigures,
) -> Report:
    report = orbit_report(
        shown.result,
        instrument_of(shown.result, otherwise=store.instrument),
        facts,
        other.result if other else None,
        simulation=store.simulation,
        more=more,
    )
    labels = facts["Report"]
    words = [report.subtitle, labels[_SOLUTION]]
    words += [f"compared with {labels[_OTHER]}"] if other is not None else []
    return replace(report, subtitle="; ".join(words))


def _survey(run: Run, other: Run | None, more: MoreFigures) -> Report:
    compared = () if other is None else ("--other", other.name)
    both = (word for name in more.both for word in ("--both", name))
    command = report_of_run(str(run.survey), run.name, "--survey", *compared, *both)
    return survey_report(run, facts_of(command, run.name), other, more)


def _source(run: Run, found: FoundSource) -> Report:
    command = report_of_run(str(run.survey), run.name, "--source", str(found.source_id))
    return source_report(run, found.source_id, facts_of(command, run.name))
