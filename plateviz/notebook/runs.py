"""Figures and changes of one run of a survey, or of two.

The plots are imported on first use, since they take seconds to import.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import pandas as pd

from plateviz.notebook.figures import FigureSpec
from plateviz.runs.load_tables import compared_run, require_same_catalogue, survey_tables
from plateviz.runs.run import Run
from plateviz.runs.run_tables import read_run_tables
from plateviz.tables.survey_tables import SurveyTables
from plateviz.verdict.run_changes import ComparedRun, run_changes
from plateviz.verdict.run_verdict import run_verdict

if TYPE_CHECKING:
    from plateviz.plots.survey_figure import SurveyFigure


def changes_of(a: Run, b: Run) -> pd.DataFrame:
    """Return `verdict.run_changes` of two runs.

    Raises
    ------
    InputError
        If one cannot be read, or they cannot be compared.
    """
    require_same_catalogue(a, b)
    return run_changes(_compared(a), _compared(b))


def figures_of_run(other: Run | None, run: Run) -> list[FigureSpec]:
    """Return the figures of a run, and those of the two if there is one to compare with."""
    from plateviz.plots.gallery import survey_figures

    tables = _tables(other, run)
    return _specs((one for one in survey_figures() if one.has_data(tables)), tables)


def figures_of_both(other: Run, run: Run) -> list[FigureSpec]:
    """Return the figures of a run, each drawn of both runs."""
    from plateviz.plots.comparison.both_runs import comparable_survey_figures, of_both_runs

    return _specs(map(of_both_runs, comparable_survey_figures()), _tables(other, run))


def _compared(run: Run) -> ComparedRun:
    tables = read_run_tables(run)
    return compared_run(run, tables, run_verdict(*tables))


def _tables(other: Run | None, run: Run) -> SurveyTables:
    if other is None:
        return survey_tables(run)
    require_same_catalogue(other, run)
    compared = survey_tables(other)
    return replace(survey_tables(run), other=compared)


def _specs(figures: "Iterable[SurveyFigure]", tables: SurveyTables) -> list[FigureSpec]:
    return [
        FigureSpec(one.name, one.title, one.caption, partial(one.plot, tables)) for one in figures
    ]
