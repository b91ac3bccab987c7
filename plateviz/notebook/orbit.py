"""OpenOrbit: the measurements of one orbit, with fits and what-ifs."""

from collections.abc import Mapping
from functools import partial

import pandas as pd
from astropy.table import QTable

from plateviz.notebook.card import card, summary_line
from plateviz.notebook.dashboard import Dashboard
from plateviz.notebook.keywords import settings_with, takes_settings
from plateviz.notebook.lazy_collection import LazyCollection, unknown_name
from plateviz.notebook.lazy_solver import HasSolver, LazySolver
from plateviz.notebook.solution import OpenSolution
from plateviz.notebook.table import OpenTable
from plateviz.runs.run import Run
from plateviz.tables import SummaryItem
from solver.data.orbit import OrbitData
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, TRUTH
from solver.data.settings import FitSettings
from solver.errors import InputError

_SCHEMAS = {
    "measurements": MEASUREMENT,
    "exposures": ENVIRONMENT,
    "catalogue": CATALOGUE,
    "truth": TRUTH,
}


class OpenOrbit(HasSolver):
    """The measurements of one orbit, its catalogue, and its solutions.

    Attributes
    ----------
    number : orbit_id
    origin_title : title of its origin
    """

    def __init__(
        self, solver: LazySolver, orbit: int | None, call: str, run: Run | None = None
    ) -> None:
        """Read and check the orbit.

        Parameters
        ----------
        solver : solver of the orbit's origin
        orbit : orbit_id; None if the origin is files with one orbit only
        call : Python code that returns this object, for reports
        run : run with a fit of the orbit, or None

        Raises
        ------
        InputError
            If the files are invalid.
        """
        super().__init__(solver)
        self._orbit, self._call = orbit, call
        self._data: OrbitData = solver.origin.read(orbit)
        self._instrument = solver.origin.read_instrument()
        self._simulation = solver.origin.read_simulation()
        self._solution = None if run is None else self._of_run(run)
        self.number = self._data.orbit_id
        self.origin_title = solver.origin.title

    @property
    def tables(self) -> LazyCollection[pd.DataFrame]:
        """The input as pandas tables: measurements, exposures, catalogue and truth."""
        found = self._tables()
        frames = {name: partial(one.frame.copy, deep=False) for name, one in found.items()}
        return LazyCollection("table", frames)

    def table(self, name: str) -> QTable:
        """Return one of `tables` as an astropy table with units."""
        found = self._tables()
        if name not in found:
            raise InputError(unknown_name("table", name, found))
        return found[name].to_astropy()

    @property
    def solution(self) -> OpenSolution:
        """The solution of the last `fit`, or else of the survey's run.

        Raises
        ------
        InputError
            If there is none yet.
        """
        if self._solution is None:
            raise InputError(
                f"orbit {self.number} of {self.origin_title}: expected a solution, found none yet; "
                ".fit() makes one"
            )
        return self._solution

    @takes_settings
    def fit(self, **settings: object) -> OpenSolution:
        """Fit the orbit, with a line of progress; other settings are the paper's.

        Parameters
        ----------
        settings : keywords of `plateviz.notebook.keywords.KEYWORDS`, such as
            `fit(order=3, priors={"distortion_x": "10um", "pitch_x": "flat"})`

        Raises
        ------
        InputError
            If a setting is invalid, or does not apply to the data.
        FitError
            If there is no solution.
        """
        self._solution = self._solve(settings_with(FitSettings(), settings), None)
        return self._solution

    @takes_settings
    def what_if(self, **settings: object) -> OpenSolution:
        """Return a what-if of the last solution, which stays the last solution.

        Parameters
        ----------
        settings : those that change, as in `fit`

        Raises
        ------
        InputError
            If there is no solution yet, or a setting is invalid.
        """
        return self.solution.what_if(**settings)

    def dashboard(self, *, port: int = 0, height: int = 900) -> Dashboard:
        """Return the dashboard of the orbit, for display in a cell; see `OpenSurvey.dashboard`."""
        return Dashboard(self._solver, port, height)

    def __repr__(self) -> str:
        """Return the title."""
        return summary_line(f"Orbit {self.number}", self.origin_title, None)

    def _repr_html_(self) -> str:
        data = self._data
        counts = {
            "Measurements": len(data.measurements),
            "Sources": data.measurements["source_id"].nunique(),
            "Reference stars": int(_measured(data)["is_reference"].sum()),
            "Exposures": len(data.exposures),
        }
        items = [SummaryItem(name, f"{count:,}", "", "neutral") for name, count in counts.items()]
        solved = "not fitted" if self._solution is None else f"fitted, {self._label()}"
        return card(f"Orbit {self.number}", f"{self.origin_title}, {solved}", None, items)

    def _label(self) -> str:
        return self.solution.settings.describe()

    def _of_run(self, run: Run) -> OpenSolution | None:
        orbits = run.orbits().set_index("orbit_id")["status"]
        if orbits.get(self._data.orbit_id) != "complete":
            return None
        result = run.result(self._data.orbit_id)
        origin_title = f"{self._solver.origin.title}, run {run.name}"
        return OpenSolution(
            result,
            self._instrument,
            origin_title,
            f"{self._call}.solution",
            what_ifs=_WhatIfs(self),
            simulation=self._simulation,
        )

    def _solve(self, settings: FitSettings, base: OpenSolution | None) -> OpenSolution:
        """Return a solution: a what-if compared with `base`, or a fit if `base` is None."""
        title = f"{'what if' if base else 'fit'}: {settings.describe()}"
        result = self._solver.solve(
            self._orbit, settings, what_if=base is not None, title=f"orbit {self.number}, {title}"
        )
        call = f"{self._call}.{'what_if' if base else 'fit'}(...)"
        return OpenSolution(
            result,
            self._instrument,
            self.origin_title,
            call,
            other=base,
            what_ifs=_WhatIfs(self),
            simulation=self._simulation,
        )

    def _tables(self) -> dict[str, OpenTable]:
        frames = {name: getattr(self._data, name) for name in _SCHEMAS}
        return {
            name: OpenTable(frame, [c for c in _SCHEMAS[name] if c.name in frame])
            for name, frame in frames.items()
            if frame is not None
        }


class _WhatIfs:
    """Computes the what-ifs of the solutions of an orbit."""

    def __init__(self, orbit: OpenOrbit) -> None:
        self._orbit = orbit

    def what_if(self, base: OpenSolution, changes: Mapping[str, object]) -> OpenSolution:
        # A what-if does not compare the orders unless asked to.
        settings = settings_with(base.settings, {"compare_orders": False, **changes})
        return self._orbit._solve(settings, base)


def _measured(data: OrbitData) -> pd.DataFrame:
    catalogue = data.catalogue
    return catalogue[catalogue["source_id"].isin(data.measurements["source_id"])]
