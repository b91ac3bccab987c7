"""OpenOrbit: the measurements of one orbit, to be fitted and asked what if."""

from collections.abc import Mapping
from functools import partial

import pandas as pd
from astropy.table import QTable

from plateviz.notebook.card import card, in_words
from plateviz.notebook.choices import settings_with, takes_choices
from plateviz.notebook.dashboard import Dashboard
from plateviz.notebook.lazy_solver import HasSolver, LazySolver
from plateviz.notebook.named import Named, no_such
from plateviz.notebook.solution import OpenSolution
from plateviz.notebook.table import OpenTable
from plateviz.runs.queries import SurveyRun
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
    """The measurements of one orbit, its catalogue, and the solutions made of them.

    Attributes
    ----------
    number : orbit_id
    origin : where it comes from, in words
    """

    def __init__(
        self, solver: LazySolver, orbit: int | None, call: str, run: SurveyRun | None = None
    ) -> None:
        """Read the orbit, and check it.

        Parameters
        ----------
        solver : solves the orbit
        orbit : of its origin, None where that is the file of one
        call : what a person wrote to get it
        run : that has it fitted, or None

        Raises
        ------
        InputError
            If something is wrong with the files.
        """
        super().__init__(solver)
        self._orbit, self._call = orbit, call
        self._data: OrbitData = solver.origin.read(orbit)
        self._instrument = solver.origin.read_instrument()
        self._solution = None if run is None else self._of_run(run)
        self.number = self._data.orbit_id
        self.origin = solver.origin.title

    @property
    def tables(self) -> Named[pd.DataFrame]:
        """What was read, as pandas has it: measurements, exposures, catalogue and truth."""
        found = self._tables()
        frames = {name: partial(one.frame.copy, deep=False) for name, one in found.items()}
        return Named("table", frames)

    def table(self, name: str) -> QTable:
        """Return one of `tables` with units, as astropy has it."""
        found = self._tables()
        if name not in found:
            raise InputError(no_such("table", name, found))
        return found[name].to_astropy()

    @property
    def solution(self) -> OpenSolution:
        """The last solution: of `fit`, else that of the survey's run.

        Raises
        ------
        InputError
            If there is none yet.
        """
        if self._solution is None:
            raise InputError(
                f"orbit {self.number} of {self.origin}: expected a solution, found none yet; "
                ".fit() makes one"
            )
        return self._solution

    @takes_choices
    def fit(self, **choices: object) -> OpenSolution:
        """Fit the orbit, with a line of progress; what is not chosen is the paper's.

        Parameters
        ----------
        choices : settings by the keywords of `plateviz.notebook.choices.KEYWORDS`, such as
            `fit(order=3, priors={"distortion_x": "10um", "pitch_x": "flat"})`

        Raises
        ------
        InputError
            If a choice cannot be used, or the data cannot hold it.
        FitError
            If there is no solution.
        """
        settings = settings_with(FitSettings(), choices)
        self._solution = self._solve(settings, None)
        return self._solution

    @takes_choices
    def what_if(self, **choices: object) -> OpenSolution:
        """Return the last solution under other choices; it stays the last one.

        Parameters
        ----------
        choices : those that are to be others, as of `fit`

        Raises
        ------
        InputError
            If there is no solution yet, or a choice cannot be used.
        """
        return self.solution.what_if(**choices)

    def dashboard(self, *, port: int = 0, height: int = 900) -> Dashboard:
        """Return the dashboard of the orbit, which a cell shows; see `OpenSurvey.dashboard`."""
        return Dashboard(self._solver, port, height)

    def __repr__(self) -> str:
        """Return what it is."""
        return in_words(f"Orbit {self.number}", self.origin, None)

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
        return card(f"Orbit {self.number}", f"{self.origin}, {solved}", None, items)

    def _label(self) -> str:
        return self.solution.settings.describe()

    def _of_run(self, run: SurveyRun) -> OpenSolution | None:
        orbits = run.orbits().set_index("orbit_id")["status"]
        if orbits.get(self._data.orbit_id) != "complete":
            return None
        result = run.result(self._data.orbit_id)
        origin = f"{self._solver.origin.title}, run {run.name}"
        return OpenSolution(
            result, self._instrument, origin, f"{self._call}.solution", refits=_Refits(self)
        )

    def _solve(self, settings: FitSettings, base: OpenSolution | None) -> OpenSolution:
        """Return a solution; by a step from the last fit where it is to be compared with one."""
        title = f"{'what if' if base else 'fit'}: {settings.describe()}"
        result = self._solver.solve(
            self._orbit, settings, what_if=base is not None, title=f"orbit {self.number}, {title}"
        )
        call = f"{self._call}.{'what_if' if base else 'fit'}(...)"
        return OpenSolution(
            result, self._instrument, self.origin, call, other=base, refits=_Refits(self)
        )

    def _tables(self) -> dict[str, OpenTable]:
        frames = {name: getattr(self._data, name) for name in _SCHEMAS}
        return {
            name: OpenTable(frame, [c for c in _SCHEMAS[name] if c.name in frame])
            for name, frame in frames.items()
            if frame is not None
        }


class _Refits:
    """What a solution of an orbit asks its orbit for."""

    def __init__(self, orbit: OpenOrbit) -> None:
        self._orbit = orbit

    def what_if(self, base: OpenSolution, choices: Mapping[str, object]) -> OpenSolution:
        # An orbit's comparison of all orders is no matter of one step.
        settings = settings_with(base.settings, {"compare_orders": False, **choices})
        return self._orbit._solve(settings, base)


def _measured(data: OrbitData) -> pd.DataFrame:
    catalogue = data.catalogue
    return catalogue[catalogue["source_id"].isin(data.measurements["source_id"])]
