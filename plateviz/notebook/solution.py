"""OpenSolution: a fitted orbit, with its tables, figures and report.

The plots are imported on first use, since Bokeh takes seconds to import.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pandas as pd
from astropy.table import QTable

from plateviz.notebook.card import card, summary_line
from plateviz.notebook.exploring import Explores
from plateviz.notebook.figures import FigureSpec, HasFigures, NotebookFigure, figure_collection
from plateviz.notebook.keywords import takes_settings
from plateviz.notebook.lazy_collection import LazyCollection, unknown_name
from plateviz.notebook.report import path_of, write_report
from plateviz.notebook.table import OpenTable, result_tables
from plateviz.tables.explore import EXPLORABLE, ExplorableTable
from plateviz.tables.summary import summary_strip
from plateviz.verdict.verdict import Verdict, orbit_verdict
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.result import write_result
from solver.io.result_instrument import require_comparable
from solver.simulate.settings import SurveySettings

if TYPE_CHECKING:
    from plateviz.plots.diagnostic import Chosen, Diagnostic
    from plateviz.reports.report import Facts, Report


class WhatIfs(Protocol):
    """Computes what-ifs of a solution."""

    def what_if(self, base: "OpenSolution", changes: Mapping[str, object]) -> "OpenSolution":
        """Return the what-if of `base` with some settings changed, by keyword."""
        ...


@dataclass(frozen=True, repr=False, eq=False)
class OpenSolution(HasFigures, Explores):
    """A fitted orbit.

    Attributes
    ----------
    result : result of the solver, `solver.data.result.FitResult`
    instrument : instrument of the orbit
    origin_title : title of its origin
    call : Python code that returns this object, for reports
    other : solution to compare with, or None
    what_ifs : computes what-ifs of the orbit; None for a solution without measurements
    simulation : settings with which the orbit was simulated; None where they are not known
    """

    result: FitResult
    instrument: Instrument
    origin_title: str
    call: str
    other: "OpenSolution | None" = None
    what_ifs: WhatIfs | None = None
    simulation: SurveySettings | None = None

    @property
    def settings(self) -> FitSettings:
        """The settings of the fit."""
        return self.result.settings

    @property
    def summary(self) -> dict[str, Any]:
        """The numbers that `plateviz fit --json` prints."""
        return dict(self.result.summary)

    @property
    def verdict(self) -> Verdict:
        """Whether to trust the solution: state, headline, reasons, and notable numbers."""
        return orbit_verdict(self.result)

    @property
    def tables(self) -> LazyCollection[pd.DataFrame]:
        """All tables by name, as pandas tables: `tables.sources`, `tables["eigenmodes"]`."""
        found = self._tables()
        return LazyCollection("table", {name: partial(_frame, one) for name, one in found.items()})

    def table(self, name: str) -> QTable:
        """Return an astropy table with units; InputError if there is no table of that name.

        Parameters
        ----------
        name : one of `tables`
        """
        found = self._tables()
        if name not in found:
            raise InputError(unknown_name("table", name, found))
        return found[name].to_astropy()

    @property
    def sources(self) -> pd.DataFrame:
        """Positions of all sources, with their uncertainties."""
        return self.tables["sources"]

    @property
    def residuals(self) -> pd.DataFrame:
        """Measured minus predicted pixel positions, a row per measurement."""
        return self.tables["residuals"]

    @property
    def exposures(self) -> pd.DataFrame:
        """Statistics of the residuals, a row per exposure."""
        return self.tables["exposures"]

    @property
    def pointings(self) -> pd.DataFrame:
        """Pointing, position angle and focal length of each exposure."""
        return self.tables["pointings"]

    @property
    def detectors(self) -> pd.DataFrame:
        """Position, rotation and pitch of each detector."""
        return self.tables["detectors"]

    @property
    def distortion(self) -> pd.DataFrame:
        """Distortion terms."""
        return self.tables["distortion"]

    def figure(
        self,
        name: str,
        *,
        exposures: Iterable[tuple[int, int]] | None = None,
        detector: int | None = None,
        both: bool = False,
        theme: str = "light",
    ) -> NotebookFigure:
        """Return a figure that displays itself.

        Parameters
        ----------
        name : one of `figures`
        exposures : (field, plate) of the exposures to show, in figures with a selection of
            exposures; all by default
        detector : detector to show, in figures with a selection of detectors; all by default
        both : whether to draw it of the solution compared with (A) and of this one (B)
        theme : "light" or "dark"

        Raises
        ------
        InputError
            If there is no such figure, exposure, detector or solution to compare with.
        """
        return self._figures_of(self._chosen(exposures, detector), theme, both)[name]

    def compared_with(self, other: "OpenSolution") -> "OpenSolution":
        """Return this solution with another to compare with, for the figure `comparison`.

        Raises
        ------
        InputError
            If `other` is no solution, or has another instrument.
        """
        if not isinstance(other, OpenSolution):
            raise InputError(f"expected a solution to compare with, found {other!r}")
        require_comparable(self.result, other.result)
        return replace(self, other=other)

    @takes_settings
    def what_if(self, **settings: object) -> "OpenSolution":
        """Return a what-if with some settings changed, by a step from the last fit if possible.

        Parameters
        ----------
        settings : those that change, as in `OpenOrbit.fit`

        Returns
        -------
        The what-if, compared with this solution.

        Raises
        ------
        InputError
            If a setting is invalid, or the solution has no measurements.
        """
        if self.what_ifs is None:
            raise InputError(
                f"{self.origin_title}: expected the measurements of an orbit to fit again, found a "
                "solution alone; plateviz.open(OBS, REF) opens the orbit"
            )
        return self.what_ifs.what_if(self, settings)

    def report(self, path: str | PathLike[str], overwrite: bool = False) -> Path:
        """Write the solution, with any comparison, as one self-contained HTML file.

        Raises
        ------
        InputError
            If the file cannot be written, or exists and is not to be overwritten.
        """
        return write_report(self._report, path, self.call, overwrite)

    def save(self, path: str | PathLike[str], overwrite: bool = False) -> Path:
        """Write the solution as `plateviz fit` does: a FITS file in the published layout.

        Raises
        ------
        InputError
            If the file cannot be written, or exists and is not to be overwritten.
        """
        target = path_of(path)
        write_result(self.result, target, overwrite)
        return target

    def __repr__(self) -> str:
        """Return the title and the verdict."""
        return summary_line(*self._titles(), self.verdict)

    def _repr_html_(self) -> str:
        return card(*self._titles(), self.verdict, summary_strip(self.result))

    def _titles(self) -> tuple[str, str]:
        compared = f", compared with {self.other.settings.describe()}" if self.other else ""
        return (
            f"Orbit {self.result.orbit_id}, {self.settings.describe()}{compared}",
            self.origin_title,
        )

    def _tables(self) -> dict[str, OpenTable]:
        return result_tables(self.result)

    def _figures(self, theme: str) -> LazyCollection[NotebookFigure]:
        return self._figures_of(self._chosen(None, None), theme)

    def _figures_of(
        self, chosen: "Chosen", theme: str, both: bool = False
    ) -> LazyCollection[NotebookFigure]:
        from plateviz.plots.comparison.both_solutions import comparable_figures, of_both
        from plateviz.plots.gallery import diagnostics

        if both and self.other is None:
            raise InputError("both: expected a solution to compare with, found none")
        known = map(of_both, comparable_figures()) if both else diagnostics()
        return figure_collection([_spec(d, chosen) for d in known if d.has_data(chosen)], theme)

    def _explorable_rows(self) -> Collection[str]:
        return EXPLORABLE

    def _explorable(self, rows: str) -> ExplorableTable:
        return EXPLORABLE[rows](self.result)

    def _chosen(
        self, exposures: Iterable[tuple[int, int]] | None, detector: int | None
    ) -> "Chosen":
        from plateviz.plots.diagnostic import Chosen

        table = self.result.exposures[["field_id", "plate_id"]]
        available = [(int(f), int(p)) for f, p in table.itertuples(index=False)]
        numbers = [one.detector_id for one in self.instrument.detectors]
        if detector is not None and detector not in numbers:
            raise InputError(f"detector: expected one of {numbers}, found {detector!r}")
        selected = tuple(available if exposures is None else _pairs(exposures))
        absent = [pair for pair in selected if pair not in available]
        if absent or not selected:
            raise InputError(
                "exposures: expected (field, plate) of the solution, such as "
                f"{available[0]}, found {absent[0] if absent else 'none'}"
            )
        other = None if self.other is None else self.other.result
        return Chosen(
            self.result, self.instrument, selected, detector, other, simulation=self.simulation
        )

    def _report(self, facts: "Facts") -> "Report":
        from plateviz.reports.orbit import orbit_report

        other = None if self.other is None else self.other.result
        return orbit_report(self.result, self.instrument, facts, other, simulation=self.simulation)


def _frame(table: OpenTable) -> pd.DataFrame:
    # A copy, so that changes do not affect the shared solution.
    return table.frame.copy(deep=False)


def _spec(figure: "Diagnostic", chosen: "Chosen") -> FigureSpec:
    return FigureSpec(figure.name, figure.title, figure.caption, partial(figure.plot, chosen))


def _pairs(exposures: object) -> list[tuple[int, int]]:
    try:
        return [(int(field), int(plate)) for field, plate in exposures]  # type: ignore[union-attr]
    except (TypeError, ValueError) as error:
        raise InputError(
            f"exposures: expected pairs (field, plate) such as (0, 3), found {exposures!r}"
        ) from error
