"""OpenSolution: a fitted orbit, with its tables, figures and report.

What draws is imported when it is asked for: HoloViews takes seconds.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pandas as pd
from astropy.table import QTable

from plateviz.notebook.card import card, in_words
from plateviz.notebook.choices import takes_choices
from plateviz.notebook.drawing import Drawing, FigureRecipe, Illustrated, drawings
from plateviz.notebook.named import Named, no_such
from plateviz.notebook.report import path_of, write_report
from plateviz.notebook.table import OpenTable, result_tables
from plateviz.tables.summary import summary_strip
from plateviz.tables.verdict import Verdict, orbit_verdict
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.result import write_result

if TYPE_CHECKING:
    from plateviz.plots.diagnostic import Chosen, Diagnostic
    from plateviz.reports.report import Facts, Report


class Refits(Protocol):
    """What fits the orbit of a solution again."""

    def what_if(self, base: "OpenSolution", choices: Mapping[str, object]) -> "OpenSolution":
        """Return the solution under other choices than those of `base`."""
        ...


@dataclass(frozen=True, repr=False, eq=False)
class OpenSolution(Illustrated):
    """A fitted orbit.

    Attributes
    ----------
    result : the solution as the solver has it, `solver.data.result.FitResult`
    instrument : that took the orbit
    origin : where it comes from, in words
    call : what a person wrote to get it
    other : solution that it is compared with, or None
    refits : what can fit the orbit again, or None
    """

    result: FitResult
    instrument: Instrument
    origin: str
    call: str
    other: "OpenSolution | None" = None
    refits: Refits | None = None

    @property
    def settings(self) -> FitSettings:
        """The choices that made it."""
        return self.result.settings

    @property
    def summary(self) -> dict[str, Any]:
        """Its numbers, as `plateviz fit --json` prints them."""
        return dict(self.result.summary)

    @property
    def verdict(self) -> Verdict:
        """Whether to trust it: a state, a headline, reasons, and what stands out."""
        return orbit_verdict(self.result)

    @property
    def tables(self) -> Named[pd.DataFrame]:
        """All its tables by name, as pandas has them: `tables.sources`, `tables["modes"]`."""
        found = self._tables()
        return Named("table", {name: partial(_frame, one) for name, one in found.items()})

    def table(self, name: str) -> QTable:
        """Return a table with units, as astropy has it; InputError if there is none of that name.

        Parameters
        ----------
        name : one of `tables`
        """
        found = self._tables()
        if name not in found:
            raise InputError(no_such("table", name, found))
        return found[name].to_astropy()

    @property
    def sources(self) -> pd.DataFrame:
        """Positions of all sources, with their uncertainties."""
        return self.tables["sources"]

    @property
    def residuals(self) -> pd.DataFrame:
        """Measured minus predicted, a row per measurement."""
        return self.tables["residuals"]

    @property
    def exposures(self) -> pd.DataFrame:
        """How each exposure fits."""
        return self.tables["exposures"]

    @property
    def pointings(self) -> pd.DataFrame:
        """Pointing, position angle and focal length of each exposure."""
        return self.tables["pointings"]

    @property
    def detectors(self) -> pd.DataFrame:
        """Place, rotation and pitch of each detector."""
        return self.tables["detectors"]

    @property
    def distortion(self) -> pd.DataFrame:
        """Terms of the distortion."""
        return self.tables["distortion"]

    def figure(
        self,
        name: str,
        *,
        exposures: Iterable[tuple[int, int]] | None = None,
        detector: int | None = None,
        theme: str = "light",
    ) -> Drawing:
        """Return a figure that displays itself.

        Parameters
        ----------
        name : one of `figures`
        exposures : (field, plate) of those to show, where the figure follows them; all by default
        detector : to show, where the figure follows it; all by default
        theme : "light" or "dark"

        Raises
        ------
        InputError
            If there is no such figure, or nothing to show in it.
        """
        return self._drawings_of(self._chosen(exposures, detector), theme)[name]

    def compared_with(self, other: "OpenSolution") -> "OpenSolution":
        """Return this solution with another to compare it with: the figure `comparison` shows it.

        Raises
        ------
        InputError
            If the other is no solution.
        """
        if not isinstance(other, OpenSolution):
            raise InputError(f"expected a solution to compare with, found {other!r}")
        return replace(self, other=other)

    @takes_choices
    def what_if(self, **choices: object) -> "OpenSolution":
        """Return the solution under other choices, by a step from the last fit where that can tell.

        Parameters
        ----------
        choices : those that are to be others, as of `OpenOrbit.fit`

        Returns
        -------
        The other solution, compared with this one.

        Raises
        ------
        InputError
            If a choice cannot be used, or there is nothing to fit again.
        """
        if self.refits is None:
            raise InputError(
                f"{self.origin}: expected the measurements of an orbit to fit again, found a "
                "solution alone; plateviz.open(OBS, REF) opens the orbit"
            )
        return self.refits.what_if(self, choices)

    def report(self, path: str | PathLike[str]) -> Path:
        """Write it, with what it is compared with, as one HTML file that opens anywhere.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        return write_report(self._report, path, self.call)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write it as `plateviz fit` does: a FITS file in the published layout.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        target = path_of(path)
        write_result(self.result, target)
        return target

    def __repr__(self) -> str:
        """Return what it is and the verdict."""
        return in_words(*self._titles(), self.verdict)

    def _repr_html_(self) -> str:
        return card(*self._titles(), self.verdict, summary_strip(self.result))

    def _titles(self) -> tuple[str, str]:
        compared = f", compared with {self.other.settings.describe()}" if self.other else ""
        return f"Orbit {self.result.orbit_id}, {self.settings.describe()}{compared}", self.origin

    def _tables(self) -> dict[str, OpenTable]:
        return result_tables(self.result)

    def _drawings(self, theme: str) -> Named[Drawing]:
        return self._drawings_of(self._chosen(None, None), theme)

    def _drawings_of(self, chosen: "Chosen", theme: str) -> Named[Drawing]:
        from plateviz.plots.gallery import diagnostics

        found = [one for one in diagnostics() if one.has_data(chosen)]
        return drawings([_figure(one, chosen) for one in found], theme)

    def _chosen(
        self, exposures: Iterable[tuple[int, int]] | None, detector: int | None
    ) -> "Chosen":
        from plateviz.plots.diagnostic import Chosen

        table = self.result.exposures[["field_id", "plate_id"]]
        there = [(int(f), int(p)) for f, p in table.itertuples(index=False)]
        numbers = [one.detector_id for one in self.instrument.detectors]
        if detector is not None and detector not in numbers:
            raise InputError(f"detector: expected one of {numbers}, found {detector!r}")
        wanted = there if exposures is None else _pairs(exposures)
        absent = [pair for pair in wanted if pair not in there]
        if absent or not wanted:
            raise InputError(
                "exposures: expected (field, plate) of the solution, such as "
                f"{there[0]}, found {absent[0] if absent else 'none'}"
            )
        other = None if self.other is None else self.other.result
        return Chosen(self.result, self.instrument, tuple(wanted), detector, other)

    def _report(self, facts: "Facts") -> "Report":
        from plateviz.reports.orbit import orbit_report

        other = None if self.other is None else self.other.result
        return orbit_report(self.result, self.instrument, facts, other)


def _frame(table: OpenTable) -> pd.DataFrame:
    # Whoever changes it changes a copy: solutions are shared.
    return table.frame.copy(deep=False)


def _figure(diagnostic: "Diagnostic", chosen: "Chosen") -> FigureRecipe:
    draw = partial(diagnostic.draw, chosen)
    return FigureRecipe(diagnostic.name, diagnostic.title, diagnostic.caption, draw)


def _pairs(exposures: object) -> list[tuple[int, int]]:
    try:
        return [(int(field), int(plate)) for field, plate in exposures]  # type: ignore[union-attr]
    except (TypeError, ValueError) as error:
        raise InputError(
            f"exposures: expected pairs (field, plate) such as (0, 3), found {exposures!r}"
        ) from error
