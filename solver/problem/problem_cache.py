"""ProblemCache: the problems of one orbit under the latest settings.

Sorting the measurements takes longer than the rest of building a problem. The latest problems
are therefore kept and rebuilt for settings that select the same measurements, or fewer.
"""

from typing import NamedTuple

import numpy as np

from solver.data.exclusions import thinned_orbit, without_excluded
from solver.data.instrument import Instrument
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.problem.adjustments import UNADJUSTED, Adjustments
from solver.problem.problem import Problem, build_problem, rebuilt, remaining

# One problem for the fit and one for the what-ifs that follow it.
_CAPACITY = 2


class _Entry(NamedTuple):
    selection: tuple[object, ...]
    adjustments: Adjustments
    data: OrbitData
    problem: Problem

    def matches(self, settings: FitSettings, adjustments: Adjustments) -> bool:
        is_same = self.adjustments.is_same(adjustments)
        return is_same and self.selection == settings.selection()


class ProblemCache:
    """Cache of the problems that settings make of one orbit."""

    def __init__(self, data: OrbitData, instrument: Instrument) -> None:
        """Start an empty cache for checked tables, as from `solver.read_orbit`."""
        self._data = data
        self._instrument = instrument
        self._entries: list[_Entry] = []

    def get(
        self, settings: FitSettings, adjustments: Adjustments = UNADJUSTED
    ) -> tuple[OrbitData, Problem]:
        """Return the tables after exclusions, thinning and adjustments, and their problem.

        Raises
        ------
        InputError
            If the settings exclude something that was not measured, or everything, or if the
            remaining measurements are too few for the distortion order.
        """
        for entry in self._entries:
            if entry.matches(settings, adjustments):
                self._keep(entry)
                return entry.data, rebuilt(entry.problem, self._instrument, settings)
        data = without_excluded(self._data, settings.exclusions)
        data = thinned_orbit(data, self._data, settings.thin)
        data = adjustments.applied(data)
        problem = self._of_fewer_rows(data, settings, adjustments)
        if problem is None:
            problem = build_problem(data, self._instrument, settings)
        self._keep(_Entry(settings.selection(), adjustments, data, problem))
        return data, problem

    def _of_fewer_rows(
        self, data: OrbitData, settings: FitSettings, adjustments: Adjustments
    ) -> Problem | None:
        """Return the problem of some tables, made from that of a table with more rows."""
        for entry in self._entries:
            if not entry.adjustments.leaves_same(adjustments):
                continue
            rows = entry.data.measurements.index
            if not 0 < len(data.measurements) < len(rows) or not rows.is_unique:
                continue
            places = rows.get_indexer(data.measurements.index)
            if places[0] >= 0 and (places[:-1] < places[1:]).all():
                # The larger one serves the next selection, too, so it stays the longest.
                self._keep(entry)
                kept = np.zeros(len(rows), dtype=bool)
                kept[places] = True
                return remaining(entry.problem, kept, self._instrument, settings)
        return None

    def _keep(self, entry: _Entry) -> None:
        """Move an entry to the front, and forget those used least recently."""
        others = (other for other in self._entries if other is not entry)
        self._entries = [entry, *others][:_CAPACITY]
