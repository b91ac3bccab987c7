"""The reports of a fitted survey, of one of its orbits, and of one of its sources."""

from dataclasses import replace
from functools import partial

from plateviz.plots.gallery import source_figures, survey_figures
from plateviz.plots.survey_figure import SourceFigure, SurveyFigure
from plateviz.reports.more_figures import NO_MORE, MoreFigures, more_of_run
from plateviz.reports.orbit import failed_orbit_report, orbit_report
from plateviz.reports.report import SOLVED, Facts, Report, ReportFigure, plain
from plateviz.runs.load_tables import compared_run, require_same_catalogue, survey_tables
from plateviz.runs.run import Run
from plateviz.runs.run_tables import RunTables
from plateviz.solving.origin import SurveyFolder
from plateviz.tables import (
    motion_in_words,
    motion_table,
    orbit_list,
    run_strip,
    source_class,
    source_orbits,
    source_strip,
)
from plateviz.tables.counts import orbits_text
from plateviz.tables.headings import CHANGES, ORBITS_OF_RUN, ORBITS_OF_SOURCE, in_words
from plateviz.tables.run_health import MISSING
from plateviz.tables.survey_tables import SourceTables, SurveyTables
from plateviz.verdict.run_changes import ComparedRun, run_changes
from plateviz.verdict.run_verdict import run_verdict
from plateviz.verdict.verdict import source_verdict
from solver.data.result import FitResult
from solver.errors import InputError
from solver.io.survey_header import section


def survey_report(
    run: Run, facts: Facts, other: Run | None = None, more: MoreFigures = NO_MORE
) -> Report:
    """Return the report of a run of a survey.

    Parameters
    ----------
    facts : provenance of the report
    other : run of the same survey to compare with
    more : figures after those of every report

    Raises
    ------
    InputError
        If orbits of a run are missing, or one of `more` cannot be drawn; orbits that failed are
        reported.
    """
    tables, changes = _whole(run), {}
    orbits, motions = tables.orbits, tables.motions
    subtitle = f"Run {run.name} of {orbits_text(len(orbits))}"
    if other is not None:
        require_same_catalogue(other, run)
        subtitle += f", compared with run {other.name}"
        of_other = _whole(other)
        both = _compared(other, of_other), _compared(run, tables)
        tables = replace(tables, other=of_other)
        title = f"What differs between run {other.name} (A) and run {run.name} (B)"
        changes[title] = in_words(run_changes(*both), CHANGES)
    return Report(
        title=f"Survey {run.survey.resolve().name}",
        subtitle=subtitle,
        verdict=run_verdict(orbits, motions, tables.tests),
        items=run_strip(orbits, motions),
        figures=[
            *(_figure(one, tables) for one in survey_figures() if one.has_data(tables)),
            *more_of_run(more, run, tables),
        ],
        tables=changes | {"Orbits": in_words(orbit_list(orbits), ORBITS_OF_RUN)},
        facts={**facts, **_of_run(run)},
    )


def survey_orbit_report(
    run: Run,
    orbit: int,
    facts: Facts,
    other: FitResult | None = None,
    has_choices: bool = True,
    more: MoreFigures = NO_MORE,
) -> Report:
    """Return the report of one orbit of a run, fitted or failed.

    Parameters
    ----------
    other : solution to compare with
    has_choices, more : as of `orbit_report`

    Raises
    ------
    InputError
        If the survey has no such orbit, the run has not fitted it, or one of `more` cannot be
        drawn.
    """
    folder = SurveyFolder(str(run.survey))
    if orbit not in folder.orbits():
        raise InputError(f"{run.survey}: expected an orbit {orbit}, found none of that number")
    facts = {**facts, SOLVED: _of_run(run)[SOLVED]}
    message = run.failures().get(orbit)
    # A process that was killed may have left why the orbit failed before it was fitted.
    if message is not None and not run.has_fitted(orbit):
        return failed_orbit_report(folder.read(orbit), message, facts)
    result, instrument = run.result(orbit), folder.read_instrument()
    simulation = folder.read_simulation()
    return orbit_report(result, instrument, facts, other, has_choices, simulation, more)


def source_report(run: Run, source_id: int, facts: Facts) -> Report:
    """Return the report of one source of a run.

    Raises
    ------
    InputError
        If the run has no such source.
    """
    history, motion = run.history(source_id), run.motion(source_id)
    if history.empty:
        raise InputError(f"{run.directory}: expected a source {source_id}, found none of that id")
    found = SourceTables(history, motion)
    tables = {} if motion is None else {"Motion": motion_in_words(motion_table(history, motion))}
    return Report(
        title=f"Source {source_id}",
        subtitle=f"{source_class(history).capitalize()} source in run {run.name}",
        verdict=source_verdict(history, motion),
        items=source_strip(history, motion),
        figures=[_figure(figure, found) for figure in source_figures()],
        tables=tables | {"Orbits": in_words(source_orbits(history), ORBITS_OF_SOURCE)},
        facts={**facts, **_of_run(run)},
    )


def _whole(run: Run) -> SurveyTables:
    """Return the tables of a run; InputError if orbits are missing."""
    tables = survey_tables(run)
    missing = int((tables.orbits["status"] == MISSING).sum())
    if missing:
        raise InputError(
            f"{run.directory}: expected a whole run, found {missing} of {len(tables.orbits)} "
            "orbits missing; `plateviz survey` continues with them"
        )
    return tables


def _compared(run: Run, tables: SurveyTables) -> ComparedRun:
    read = RunTables(tables.orbits, tables.motions, tables.tests)
    return compared_run(run, read, run_verdict(*read))


def _of_run(run: Run) -> Facts:
    """Return versions, settings and inputs of the run."""
    header = run.header()
    titles = {SOLVED: "versions", "Settings": "settings", "Inputs (SHA-256)": "inputs"}
    return {title: plain(section(header, name)) for title, name in titles.items()}


def _figure(
    figure: SurveyFigure | SourceFigure, tables: SurveyTables | SourceTables
) -> ReportFigure:
    plot = partial(figure.plot, tables)  # type: ignore[arg-type]
    return ReportFigure(figure.name, figure.title, figure.caption, {"All": plot}, figure.is_wide)
