"""Whether the engines agree: the same orbit by each of them, compared source by source."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from solver.data.result import FitResult

# What svi has to reach, of a marginal sigma and of a conditional one.
_MEANS, _SIGMAS = 0.05, 0.02
# A figure of Monte-Carlo origin is refused where chance would give it once in so many runs.
_CHANCE = 1e-3
_AXES = ("ra", "dec")


class Comparison(NamedTuple):
    """One figure of an engine against gauss-newton, and the largest that agrees."""

    engine: str
    what: str
    found: float
    limit: float

    @property
    def agrees(self) -> bool:
        """Whether the figure is within its limit."""
        return bool(self.found <= self.limit)


def compare(results: Mapping[str, FitResult]) -> list[Comparison]:
    """Compare the results of the other engines with that of gauss-newton.

    Parameters
    ----------
    results : by engine, of the same orbit and settings but for the engine
    """
    exact = results["gauss-newton"]
    rows = []
    if "svi" in results:
        found = results["svi"]
        rows += [
            Comparison(
                "svi",
                "largest shift of a source, marginal sigmas",
                float(np.abs(_shifts(found, exact)).max()),
                _MEANS,
            ),
            Comparison(
                "svi",
                "largest relative change of a conditional sigma",
                float(np.abs(_ratios(found, exact, "conditional") - 1.0).max()),
                _SIGMAS,
            ),
        ]
    if "nuts" in results:
        found = results["nuts"]
        of_means, of_sigmas = (
            float(found.summary[f"smallest_effective_samples{kind}"]) for kind in ("", "_of_sigmas")
        )
        shifts = _shifts(found, exact) * np.sqrt(of_means)
        ratios = (_ratios(found, exact, "marginal") - 1.0) * np.sqrt(2.0 * of_sigmas)
        limit = float(norm.isf(0.5 * _CHANCE / shifts.size))
        rows += [
            Comparison(
                "nuts",
                "largest shift of a source, Monte-Carlo errors",
                float(np.abs(shifts).max()),
                limit,
            ),
            Comparison(
                "nuts",
                "largest change of a marginal sigma, Monte-Carlo errors",
                float(np.abs(ratios).max()),
                limit,
            ),
        ]
    return rows


def _shifts(found: FitResult, exact: FitResult) -> np.ndarray:
    """Return the shifts of all coordinates in their marginal sigmas."""
    return np.concatenate(
        [
            (found.sources[f"offset_{axis}"] - exact.sources[f"offset_{axis}"])
            / exact.sources[f"sigma_{axis}_marginal"]
            for axis in _AXES
        ]
    )


def _ratios(found: FitResult, exact: FitResult, kind: str) -> np.ndarray:
    names = [f"sigma_{axis}_{kind}" for axis in _AXES]
    return np.concatenate([found.sources[name] / exact.sources[name] for name in names])
