"""VectorLayout: where each calibration parameter stands in the flat vector the engines solve for.

Exposures come first, all groups of one exposure together, then the distortion's two
directions, then the detectors, all groups of one detector together: the parameters that
one measurement touches lie in three runs of columns.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Int, Shaped

from solver.data.parameters import CALIBRATION_GROUPS, Group, groups_on

PER_EXPOSURE = groups_on("exp")
PER_COEFFICIENT = groups_on("coef")
PER_DETECTOR = groups_on("det")
# NumPy's or JAX's.
AnyArray = Any
# The groups of which a measurement touches one element each.
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
        """Return the columns of `LOCAL_GROUPS` for exposures and detectors, side by side."""
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
        """Return the flat vector of values given per group."""
        flat = np.empty(self.size)
        for group in CALIBRATION_GROUPS:
            flat[self.columns(group)] = values[group.name]
        return flat

    def scatter(self, flat: Shaped[AnyArray, " calib"]) -> dict[str, Shaped[AnyArray, " _"]]:
        """Return the values per group of a flat vector, of NumPy or JAX."""
        return {group.name: flat[self.columns(group)] for group in CALIBRATION_GROUPS}
