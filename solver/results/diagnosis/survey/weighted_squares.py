"""A weighted sum of squares of normal deviates as a chi2 that has the same chance."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class WeightedSquares(NamedTuple):
    """A weighted sum of squares of unit normal deviates, as a linear function of a chi2.

    Their first three moments are the same (Imhof, Biometrika 48, 419, 1961). With the weights of a
    run, the chance of large values is a twelfth too small at 0.001 and a quarter at 0.00001.

    Attributes
    ----------
    dof : of the chi2
    mean : of the sum
    step : of the chi2, for one of the sum
    """

    dof: float
    mean: float
    step: float

    @classmethod
    def of(cls, weights: Float[np.ndarray, " deviate"]) -> "WeightedSquares":
        """Return that of positive weights."""
        first, second, third = (float(np.sum(weights**k)) for k in (1, 2, 3))
        dof = second**3 / third**2
        return cls(dof, first, float(np.sqrt(dof / second)))

    def chi2(self, total: float) -> float:
        """Return the chi2 of a sum."""
        return max(self.dof + self.step * (total - self.mean), 0.0)

    def total(self, chi2: float) -> float:
        """Return the sum of a chi2."""
        return self.mean + (chi2 - self.dof) / self.step
