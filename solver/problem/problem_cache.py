"""ProblemCache: the measurements of one orbit that settings choose, as a problem to solve.

Sorting the measurements takes longer than everything else that a problem is made of. So what
was chosen last is kept, for the other settings that choose the same.
"""

from typing import NamedTuple

import pandas as pd

from solver.data.exclusions import Exclusions, of_rows, thinned_orbit
from solver.data.instrument import Instrument
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.problem.problem import Problem, build_problem, rebuilt

# That of a fit, and that of what is asked of it.
_KEPT = 2


class _Choice(NamedTuple):
    exclusions: Exclusions
    thin: int
    outliers: pd.DataFrame | None
    data: OrbitData
    problem: Problem

    def is_that_of(self, settings: FitSettings, outliers: pd.DataFrame | None) -> bool:
        same = (self.exclusions, self.thin) == (settings.exclusions, settings.thin)
        return same and self.outliers is outliers


class ProblemCache:
    """One orbit, from which settings choose."""

    def __init__(self, data: OrbitData, instrument: Instrument) -> None:
        """Take checked tables, as from `solver.read_orbit`."""
        self._data = data
        self._instrument = instrument
        self._last: list[_Choice] = []

    def choose(
        self, settings: FitSettings, outliers: pd.DataFrame | None = None
    ) -> tuple[OrbitData, Problem]:
        """Return the tables of what is chosen, and the problem that they make.

        Parameters
        ----------
        outliers : measurements to leave out, too, by the labels of the orbit's table

        Raises
        ------
        InputError
            If the settings exclude what was not measured, or all that was, or ask for what the
            rest cannot hold.
        """
        for choice in self._last:
            if choice.is_that_of(settings, outliers):
                return choice.data, rebuilt(choice.problem, self._instrument, settings)
        data = settings.exclusions.without(self._data)
        data = thinned_orbit(data, self._data, settings.thin)
        if outliers is not None:
            data = of_rows(data, ~data.measurements.index.isin(outliers.index))
        problem = build_problem(data, self._instrument, settings)
        choice = _Choice(settings.exclusions, settings.thin, outliers, data, problem)
        self._last = [choice, *self._last][:_KEPT]
        return data, problem
