"""VectorLayout: columns of the calibration parameters in the flat vector the engines solve for.

Exposures come first, all groups of one exposure together, then the distortion's two
directions, then the detectors, all groups of one detector together. The parameters that
one measurement depends on therefore lie in three contiguous ranges.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Int, Shaped

from solver.data.parameters import CALIBRATION_GROUPS, Group, groups_on

PER_EXPOSURE = groups_on("exp")
PER_COEFFICIENT = groups_on("coef")
PER_DETECTOR = groups_on("det")
# A NumPy or JAX array.
AnyArray = Any
# Groups of which a measurement depends on one element each.
LOCAL_GROUPS = PER_EXPOSURE + PER_DETECTOR


@dataclass(frozen=True)
class VectorLayout:
    """Sizes of the calibration axes and the columns that follow from them."""

    n_exp: int
    n_coef: int
    n_det: int

    @property
    def size(self) -> int:
        """Number of calibration parameters."""
        return self.first_detector + self.n_det * len(PER_DETECTOR)

    @property
    def first_coefficient(self) -> int:
        """Column of the first distortion coefficient."""
        return self.n_exp * len(PER_EXPOSURE)

    @property
    def first_detector(self) -> int:
        """Column of the first detector parameter."""
        return self.first_coefficient + self.n_coef * len(PER_COEFFICIENT)

    def coefficients(self) -> slice:
        """Return the columns of the distortion, first all of A, then all of B."""
        return slice(self.first_coefficient, self.first_detector)

    def touched(
        self, exposure: Int[np.ndarray, "*n"], detector: Int[np.ndarray, "*n"]
    ) -> Int[np.ndarray, "*n local"]:
        """Return the columns of `LOCAL_GROUPS`, as the last axis, of exposures and detectors."""
        return np.stack(
            [
                self.columns(group)[exposure if group.axis == "exp" else detector]
                for group in LOCAL_GROUPS
            ],
            axis=-1,
        )

    def columns(self, group: Group) -> np.ndarray:
        """Return the columns of one group, in the order of its axis."""
        if group.axis == "coef":
            first = self.first_coefficient + PER_COEFFICIENT.index(group) * self.n_coef
            return np.arange(first, first + self.n_coef)
        members, first, count = (
            (PER_EXPOSURE, 0, self.n_exp)
            if group.axis == "exp"
            else (PER_DETECTOR, self.first_detector, self.n_det)
        )
        return first + members.index(group) + len(members) * np.arange(count)

    def gather(self, values: dict[str, Shaped[np.ndarray, " _"]]) -> Shaped[np.ndarray, " calib"]:
        """Return the flat vector from values per group."""
        flat = np.empty(self.size)
        for group in CALIBRATION_GROUPS:
            flat[self.columns(group)] = values[group.name]
        return flat

    def scatter(self, flat: Shaped[AnyArray, " calib"]) -> dict[str, Shaped[AnyArray, " _"]]:
        """Return the values per group from a flat NumPy or JAX vector."""
        return {group.name: flat[self.columns(group)] for group in CALIBRATION_GROUPS}
