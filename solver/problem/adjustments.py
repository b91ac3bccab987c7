"""Adjustments: what a fit finds before its solution, and what its what-ifs keep."""

from dataclasses import replace
from typing import NamedTuple

import pandas as pd

from solver.data.detector_spans import Move, with_moves
from solver.data.exclusions import orbit_of_rows
from solver.data.orbit import OrbitData
from solver.problem.noise import Noise


class Adjustments(NamedTuple):
    """Changes of the tables of an orbit, beside those that the settings ask for.

    Attributes
    ----------
    outliers : measurements to leave out, by the labels of the orbit's table; None if not searched
    moves : of detectors within a field
    noise : uncertainties in place of those of the tables; None if these hold
    """

    outliers: pd.DataFrame | None = None
    moves: tuple[Move, ...] = ()
    noise: Noise | None = None

    def is_same(self, other: "Adjustments") -> bool:
        """Return whether another makes the same tables."""
        return self.outliers is other.outliers and self.leaves_same(other)

    def leaves_same(self, other: "Adjustments") -> bool:
        """Return whether another makes the same of the measurements that both keep."""
        return self.noise is other.noise and self.moves == other.moves

    def applied(self, data: OrbitData) -> OrbitData:
        """Return the adjusted tables."""
        if self.outliers is not None:
            data = orbit_of_rows(data, ~data.measurements.index.isin(self.outliers.index))
        if self.moves:
            data = replace(data, exposures=with_moves(data.exposures, self.moves))
        return data if self.noise is None else self.noise.applied(data)


UNADJUSTED = Adjustments()
