"""OpenSource: one source through the orbits of a run."""

from contextlib import suppress
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
from astropy.table import QTable

from plateviz.notebook.card import card, summary_line
from plateviz.notebook.figures import FigureSpec, HasFigures, NotebookFigure, figure_collection
from plateviz.notebook.lazy_collection import LazyCollection
from plateviz.notebook.report import write_report
from plateviz.notebook.table import OpenTable
from plateviz.runs.run import Run
from plateviz.tables import motion_table, source_class, source_strip, time_series
from plateviz.verdict.verdict import Verdict, source_verdict
from solver.data.ids import is_id
from solver.data.survey_schema import HISTORY
from solver.errors import InputError

if TYPE_CHECKING:
    from plateviz.reports.report import Facts, Report


class OpenSource(HasFigures):
    """One source in a run, orbit by orbit.

    Attributes
    ----------
    source_id : id in the catalogue
    kind : "reference", "non-reference" or "artificial"
    """

    def __init__(self, run: Run, source_id: int | str, call: str) -> None:
        """Find a source in a run.

        Parameters
        ----------
        call : Python code that returns this object, for reports

        Raises
        ------
        InputError
            If the run has no source of that id.
        """
        self._run, self._call = run, call
        self.source_id = id_of(source_id)
        self._history, self._motion = run.history(self.source_id), run.motion(self.source_id)
        if self._history.empty:
            raise InputError(
                f"run {run.name!r} of {run.survey.name}: expected a source {self.source_id}, "
                "found none of that id; .sources lists them"
            )
        self.kind = source_class(self._history)

    @property
    def history(self) -> pd.DataFrame:
        """Positions, a row per orbit: `solver.data.survey_schema.HISTORY`."""
        return self._history.copy(deep=False)

    @property
    def time_series(self) -> pd.DataFrame:
        """Offsets against time, as in the figure `time-series`."""
        return time_series(self._history, self._motion)

    @property
    def motion(self) -> pd.DataFrame:
        """Fitted position, parallax and proper motion, and what they are off the catalogue.

        Raises
        ------
        InputError
            If the run is not complete: motions are fitted once all orbits are fitted.
        """
        if self._motion is None:
            raise InputError(
                f"run {self._run.name!r}: expected a complete run, found orbits without a fit"
            )
        return motion_table(self._history, self._motion)

    def table(self) -> QTable:
        """Return `history` as an astropy table with units."""
        return OpenTable(self._history, list(HISTORY)).to_astropy()

    @property
    def verdict(self) -> Verdict:
        """Whether the positions agree with the fitted motion."""
        return source_verdict(self._history, self._motion)

    def report(self, path: str | PathLike[str], overwrite: bool = False) -> Path:
        """Write a self-contained HTML file.

        Raises
        ------
        InputError
            If the file cannot be written, or exists and is not to be overwritten.
        """
        return write_report(self._report, path, self._call, overwrite, self._run.name)

    def __repr__(self) -> str:
        """Return the title and the verdict."""
        return summary_line(*self._titles(), self.verdict)

    def _repr_html_(self) -> str:
        return card(*self._titles(), self.verdict, source_strip(self._history, self._motion))

    def _titles(self) -> tuple[str, str]:
        origin_title = f"{self._run.survey.resolve().name}, run {self._run.name}"
        return f"{self.kind.capitalize()} source {self.source_id}", origin_title

    def _figures(self, theme: str) -> LazyCollection[NotebookFigure]:
        # The plots take seconds to import.
        from plateviz.plots.gallery import source_figures
        from plateviz.plots.survey_figure import SourceTables

        tables = SourceTables(self._history, self._motion)
        figures = [
            FigureSpec(one.name, one.title, one.caption, partial(one.plot, tables))
            for one in source_figures()
        ]
        return figure_collection(figures, theme)

    def _report(self, facts: "Facts") -> "Report":
        from plateviz.reports.survey import source_report

        return source_report(self._run, self.source_id, facts)


def id_of(given: object) -> int:
    """Return the id of a source given as a number or as text.

    Raises
    ------
    InputError
        If it is not a 64-bit integer.
    """
    with suppress(ValueError):
        number = int(str(given))
        if is_id(number):
            return number
    raise InputError(f"expected the id of a source, a whole number, found {given!r}")
