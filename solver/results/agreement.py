"""Agreement of the engines: fits of the same orbit, compared source by source."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from solver.data.result import FitResult

# Limits for svi: of the shifts in marginal sigmas, and of relative changes of conditional sigmas.
_MEANS, _SIGMAS = 0.05, 0.02
# Probability that a number with Monte-Carlo errors exceeds its limit by chance.
_CHANCE = 1e-3
_AXES = ("ra", "dec")


class Agreement(NamedTuple):
    """One number that compares an engine with gauss-newton, and its limit."""

    engine: str
    what: str
    found: float
    limit: float

    @property
    def agrees(self) -> bool:
        """Whether the number is within its limit."""
        return bool(self.found <= self.limit)


def compare_engines(results: Mapping[str, FitResult]) -> list[Agreement]:
    """Compare the results of the other engines with that of gauss-newton.

    Parameters
    ----------
    results : results by engine, of the same orbit and otherwise the same settings
    """
    exact = results["gauss-newton"]
    rules = {"svi": _of_svi, "nuts": _of_nuts}
    return [
        row
        for engine, rule in rules.items()
        if engine in results
        for row in rule(results[engine], exact)
    ]


def _of_svi(found: FitResult, exact: FitResult) -> list[Agreement]:
    shift = float(np.abs(_shifts(found, exact)).max())
    change = float(np.abs(_ratios(found, exact, "conditional") - 1.0).max())
    return [
        Agreement("svi", "largest shift of a source, marginal sigmas", shift, _MEANS),
        Agreement("svi", "largest relative change of a conditional sigma", change, _SIGMAS),
    ]


def _of_nuts(found: FitResult, exact: FitResult) -> list[Agreement]:
    n_means, n_sigmas = (
        float(found.summary[f"smallest_effective_samples{kind}"]) for kind in ("", "_of_sigmas")
    )
    shifts = _shifts(found, exact) * np.sqrt(n_means)
    changes = (_ratios(found, exact, "marginal") - 1.0) * np.sqrt(2.0 * n_sigmas)
    limit = float(norm.isf(0.5 * _CHANCE / shifts.size))
    return [
        Agreement("nuts", f"largest {what}, Monte-Carlo errors", float(np.abs(of_all).max()), limit)
        for what, of_all in (("shift of a source", shifts), ("change of a marginal sigma", changes))
    ]


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
    """Return the ratios of the sigmas of all coordinates; `kind` is conditional or marginal."""
    names = [f"sigma_{axis}_{kind}" for axis in _AXES]
    return np.concatenate([found.sources[name] / exact.sources[name] for name in names])
