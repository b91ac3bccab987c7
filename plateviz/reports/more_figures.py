"""Figures that a report has on request: of both solutions that it compares, and of *Explore*."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from plateviz.plots.comparison.both_runs import comparable_survey_figures, of_both_runs
from plateviz.plots.comparison.both_solutions import comparable_figures, of_both
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.explore.explored import explored
from plateviz.plots.explore.explored_text import parse_explored
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.reports.report import ReportFigure
from plateviz.runs.column_cache import ColumnCache
from plateviz.runs.explorable import COLUMNS_OF_RUN, explorable_of_run
from plateviz.runs.run import Run
from plateviz.tables.explore import EXPLORABLE, ExplorableTable
from plateviz.tables.survey_tables import SurveyTables
from solver.errors import InputError


class MoreFigures(NamedTuple):
    """Figures besides those that every report has.

    Attributes
    ----------
    both : names of figures that are drawn of both solutions, or of both runs
    explored : as from `plateviz.plots.explore.explored_text.text_of`
    """

    both: Sequence[str] = ()
    explored: Sequence[str] = ()


NO_MORE = MoreFigures()


def more_of_orbit(more: MoreFigures, chosen: Chosen) -> list[ReportFigure]:
    """Return the figures of a solution; InputError if one cannot be drawn."""

    def table(rows: str) -> ExplorableTable:
        return EXPLORABLE[rows](chosen.result)

    known = {one.name: of_both(one) for one in comparable_figures()}
    both = _of_both(more.both, known, chosen)
    return [*both, *_explored(more.explored, EXPLORABLE, table)]


def more_of_run(more: MoreFigures, run: Run, tables: SurveyTables) -> list[ReportFigure]:
    """Return the figures of a run; InputError if one cannot be drawn.

    Parameters
    ----------
    tables : of the run, with those of the other run if there is one
    """
    columns = ColumnCache()
    known = {one.name: one for one in comparable_survey_figures()}
    both = _of_both(more.both, {name: of_both_runs(one) for name, one in known.items()}, tables)
    explored = _explored(
        more.explored, COLUMNS_OF_RUN, lambda rows: explorable_of_run(run, rows, columns)
    )
    return [*both, *explored]


def _of_both(
    names: Sequence[str],
    known: Mapping[str, Diagnostic] | Mapping[str, SurveyFigure],
    shown: Chosen | SurveyTables,
) -> list[ReportFigure]:
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(f"both: expected a figure out of {', '.join(known)}, found {unknown[0]!r}")
    if names and shown.other is None:
        raise InputError("both: expected something to compare with, found none")
    return [
        ReportFigure(
            f"both-{name}",
            known[name].title,
            known[name].caption,
            {"All": partial(known[name].plot, shown)},  # type: ignore[arg-type]
            is_wide=True,
        )
        for name in names
    ]


def _explored(
    texts: Sequence[str], known: Iterable[str], table_of: Callable[[str], ExplorableTable]
) -> list[ReportFigure]:
    figures, names = [], tuple(known)
    for number, text in enumerate(texts):
        found = explored(*parse_explored(text), names, table_of)
        plots = {"All": found.plot}
        figures.append(
            ReportFigure(f"explore-{number}", found.title, found.caption, plots, is_wide=True)
        )
    return figures
