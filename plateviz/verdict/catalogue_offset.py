"""The other stars of a catalogue against its reference stars, which may be displaced together.

The reference stars place the solution on the sky. If they are displaced together, so are all
positions, and no residual shows it. The catalogue positions of the other stars do, in the mean of
many, though each of them is uncertain.
"""

from typing import NamedTuple

import numpy as np

from plateviz.tables.rounded import rounded, with_error
from plateviz.verdict.causes import Cause
from solver.data.result import FitResult
from solver.results.diagnosis.rate import sigmas

_AXES = ("ra", "dec")
# Fewer stars tell too little.
_LEAST = 20
# Chance of a larger offset from which it is none by accident.
_LOG_CHANCE = float(np.log(1e-6))
# Share of the stated error of a single star from which the catalogue contradicts itself. Less may
# be that of another catalogue, from which the other stars were taken.
_MUCH = 0.5
# Of normal values: sigma over the median distance from the median; sigma of the median of n of
# them, times the root of n.
_SIGMA_OF_DISTANCE, _SIGMA_OF_MEDIAN = 1.4826, 1.2533


class CatalogueOffset(NamedTuple):
    """Median distance of the other stars from the catalogue; pairs are of α cos δ and δ, mas.

    Attributes
    ----------
    count : number of these stars
    median, expected : the distance, and what it is by chance
    stated : error of a single star along an axis, mas
    """

    count: int
    median: tuple[float, float]
    expected: tuple[float, float]
    stated: float

    @property
    def size(self) -> float:
        """The distance on the sky, mas."""
        return float(np.hypot(*self.median))

    @property
    def log_chance(self) -> float:
        """The logarithm of the chance of a larger one."""
        ratios = np.divide(self.median, self.expected)
        return -0.5 * float(np.sum(ratios**2))

    @property
    def is_contradiction(self) -> bool:
        """Whether the two parts of the catalogue are further apart than they can be."""
        return self.size >= _MUCH * self.stated

    def cause(self) -> Cause:
        """Return it as what spoils the solution."""
        return Cause(
            "catalogue-offset",
            "the reference stars and the other stars of the catalogue are apart",
            self._words(),
            sigmas(self.log_chance),
            self._harm(),
            "compare the reference stars with another catalogue, and check the frame and the epoch "
            "of both parts of this one",
            (),
            is_large=True,
        )

    def sentences(self) -> str:
        """Return it as what stands out, but is no fault."""
        return f"{self._words()} {self._harm()}"

    def _words(self) -> str:
        by_axis = " and ".join(
            f"{with_error(value, error)} mas in {name}"
            for value, error, name in zip(self.median, self.expected, ("α cos δ", "δ"), strict=True)
        )
        return (
            f"In the median, the {self.count:,} other stars are {by_axis} from where the catalogue "
            "has them."
        )

    def _harm(self) -> str:
        return (
            "If the reference stars are displaced, so are all positions, by "
            f"{rounded(self.size, 3)} mas, and no residual shows it; if the others are, nothing is "
            "spoiled."
        )


def catalogue_offset(result: FitResult) -> CatalogueOffset | None:
    """Return the offset if it is none by accident; single stars that are far off make none."""
    sources = result.sources
    is_other = ~sources["is_reference"].to_numpy(dtype=bool)
    count = int(is_other.sum())
    if count < _LEAST or count == len(sources):
        return None
    distances, stated = (
        [sources[f"{name}_{axis}"].to_numpy(dtype=float)[is_other] for axis in _AXES]
        for name in ("offset", "prior_sigma")
    )
    median = [float(np.median(along)) for along in distances]
    spread = [
        _SIGMA_OF_DISTANCE * float(np.median(np.abs(along - middle)))
        for along, middle in zip(distances, median, strict=True)
    ]
    # The reference stars let all others have an error in common.
    shared = [float(result.summary[f"mean_error_{axis}"]) for axis in _AXES]
    expected = np.hypot(_SIGMA_OF_MEDIAN * np.array(spread) / np.sqrt(count), shared)
    found = CatalogueOffset(
        count, (median[0], median[1]), (expected[0], expected[1]), float(np.median(stated))
    )
    return found if found.log_chance < _LOG_CHANCE else None
