"""Pulls, coverage and ranks of a fit against the truth, summed by group, and their errors.

The parameters of one orbit share errors, so that their pulls are correlated. Standard errors are
therefore taken across orbits (delete-one jackknife), and the ranks are tested for uniformity by the
scatter of the orbits' histograms (Hotelling's T squared).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from solver.data.parameters import CALIBRATION_GROUPS
from solver.data.result import FitResult
from solver.units import MAS_PER_DEG

REFERENCES, OTHERS = "reference sources", "other sources"
GROUPS = (REFERENCES, OTHERS, *(group.name for group in CALIBRATION_GROUPS))
KINDS = ("marginal", "conditional")
# Half-widths of the intervals, sigma, and the share of a normal distribution that each holds.
INTERVALS = {1.0: 0.6827, 1.96: 0.9500}
BINS = 20
# Two bins of the records make one of the test, which needs more orbits than bins.
_TESTED_BINS = 10
# Fewer orbits do not tell their own standard error.
_MIN_ORBITS = 20
_TURN = 360.0 * 3600.0

Sums = dict[str, Any]


class Figure(NamedTuple):
    """A figure of all orbits, what is expected, and the standard error of that across orbits."""

    value: float
    error: float
    expected: float

    @property
    def off(self) -> float:
        return abs(self.value - self.expected)


def sums_of(result: FitResult, truth: dict[str, np.ndarray]) -> dict[str, Sums]:
    """Return the sums of one orbit by group.

    Parameters
    ----------
    result : with the true places of the sources
    truth : true offsets from the prior centres of each calibration group, in its unit
    """
    return {
        group: pull_sums(*errors)
        for group, errors in {**_of_sources(result), **_of_calibration(result, truth)}.items()
    }


def _of_sources(result: FitResult) -> dict[str, tuple[np.ndarray, dict[str, np.ndarray]]]:
    joined = result.sources.merge(result.true_places, on="source_id", suffixes=("", "_true"))
    cos_dec = np.cos(np.radians(joined["dec"]))
    found = {}
    for group, rows in {
        REFERENCES: joined["is_reference"],
        OTHERS: ~joined["is_reference"],
    }.items():
        chosen, stretch = joined[rows], {"ra": cos_dec[rows], "dec": 1.0}
        error = _both(
            MAS_PER_DEG * stretch[axis] * (chosen[axis] - chosen[f"{axis}_true"])
            for axis in ("ra", "dec")
        )
        sigmas = {
            kind: _both(chosen[f"sigma_{axis}_{kind}"] for axis in ("ra", "dec")) for kind in KINDS
        }
        found[group] = error, sigmas
    return found


def _both(columns: Any) -> np.ndarray:
    return np.concatenate([np.asarray(column, dtype=np.float64) for column in columns])


def _of_calibration(
    result: FitResult, truth: dict[str, np.ndarray]
) -> dict[str, tuple[np.ndarray, dict[str, np.ndarray]]]:
    found = {}
    for group in CALIBRATION_GROUPS:
        rows = result.calibration[result.calibration["group"] == group.name]
        error = rows["offset"].to_numpy() - truth[group.name]
        if group.name == "position_angle":
            error = np.remainder(error + 0.5 * _TURN, _TURN) - 0.5 * _TURN
        found[group.name] = error, {kind: rows[f"sigma_{kind}"].to_numpy() for kind in KINDS}
    return found


def pull_sums(error: np.ndarray, sigmas: dict[str, np.ndarray]) -> Sums:
    """Return the sums of some parameters from their errors and their sigmas of each kind."""
    sums: Sums = {"n": len(error)}
    for kind, sigma in sigmas.items():
        pull = error / sigma
        ranks = np.minimum((BINS * stats.norm.cdf(pull)).astype(int), BINS - 1)
        sums[kind] = {
            "squares": float(pull @ pull),
            "inside": [int((np.abs(pull) < limit).sum()) for limit in INTERVALS],
            "ranks": np.bincount(ranks, minlength=BINS).tolist(),
        }
    return sums


def figures(orbits: Sequence[Sums], kind: str) -> list[Figure]:
    """Return the rms pull and the coverage of each interval of one group over all orbits."""
    number = np.array([sums["n"] for sums in orbits], dtype=np.float64)
    squares = np.array([sums[kind]["squares"] for sums in orbits])
    inside = np.array([sums[kind]["inside"] for sums in orbits], dtype=np.float64)
    mean, error = _jackknife(squares, number)
    rms = float(np.sqrt(mean))
    covered = [_jackknife(inside[:, column], number) for column in range(len(INTERVALS))]
    # Orbits whose pulls happen to be small scatter little. All errors are therefore those of what
    # is expected: the relative error of the mean square, and the error of the expected coverage of
    # as many independent parameters as the scatter in the narrowest interval implies.
    found = [Figure(rms, error / (2.0 * mean), 1.0)]
    first, its_error = covered[0]
    per_variance = its_error**2 / max(first * (1.0 - first), np.finfo(float).tiny)
    for share, (value, jackknife) in zip(INTERVALS.values(), covered, strict=True):
        expected = float(np.sqrt(share * (1.0 - share) * per_variance))
        found.append(Figure(value, expected or jackknife, share))
    return found


def _jackknife(sums: np.ndarray, number: np.ndarray) -> tuple[float, float]:
    """Return the ratio of the totals of all orbits, and its standard error."""
    count = len(sums)
    if count < 2:
        return float(sums.sum() / number.sum()), float("nan")
    without = (sums.sum() - sums) / (number.sum() - number)
    spread = np.sum((without - without.mean()) ** 2)
    return float(sums.sum() / number.sum()), float(np.sqrt((count - 1) / count * spread))


def uniformity(orbits: Sequence[Sums], kind: str = "marginal") -> float:
    """Return the probability of ranks at least as far from uniform as those of all orbits.

    NaN if there are too few orbits to estimate how the bins scatter together.
    """
    count, free = len(orbits), _TESTED_BINS - 1
    if count <= 2 * _TESTED_BINS:
        return float("nan")
    ranks = np.array([sums[kind]["ranks"] for sums in orbits], dtype=np.float64)
    ranks = ranks.reshape(count, _TESTED_BINS, -1).sum(axis=-1)
    # Excess over uniform; the bins of one orbit sum to zero, so that one is redundant.
    excess = (ranks - ranks.sum(axis=1, keepdims=True) / _TESTED_BINS)[:, :free]
    mean, covariance = excess.mean(axis=0), np.cov(excess.T) / count
    statistic = mean @ np.linalg.pinv(covariance, hermitian=True) @ mean
    return float(stats.f.sf(statistic * (count - free) / (free * (count - 1)), free, count - free))


def table(records: Sequence[dict[str, Sums]]) -> pd.DataFrame:
    """Return a row per group with all figures, as text."""
    rows = []
    for group in GROUPS:
        orbits = [record[group] for record in records if record[group]["n"]]
        row: dict[str, object] = {"group": group, "number": sum(one["n"] for one in orbits)}
        for kind in KINDS:
            rms, *covered = figures(orbits, kind)
            row[f"rms pull, {kind}"] = _rounded(rms)
            for share, one in zip(("68.3 %", "95 %"), covered, strict=True):
                row[f"{share}, {kind}"] = f"{100 * one.value:.1f} ± {100 * one.error:.1f}"
        row["ranks uniform, p"] = f"{uniformity(orbits):.2f}"
        rows.append(row)
    return pd.DataFrame(rows)


def rank_table(records: Sequence[dict[str, Sums]], kind: str = "marginal") -> pd.DataFrame:
    """Return the share of the ranks in every tenth of the posterior, per cent, as text."""
    rows = []
    for group in GROUPS:
        ranks = np.array([record[group][kind]["ranks"] for record in records]).sum(axis=0)
        tenths = 100.0 * ranks.reshape(_TESTED_BINS, -1).sum(axis=1) / ranks.sum()
        shares = {f"{10 * i} %": f"{share:.1f}" for i, share in enumerate(tenths)}
        rows.append({"group": group, **shares})
    return pd.DataFrame(rows)


def _rounded(rms: Figure) -> str:
    digits = 3 if rms.value < 10.0 else 0
    return f"{rms.value:.{digits}f} ± {rms.error:.{digits}f}"


def failures(
    records: Sequence[dict[str, Sums]], rms_tolerance: float, coverage_tolerance: float
) -> list[str]:
    """Return the figures of the marginal sigma that are off, in words.

    A figure is off if it misses what is expected by more than its tolerance and by more than three
    standard errors. Of fewer than 20 orbits none is.
    """
    names = ("rms pull", "68.3 % coverage", "95 % coverage")
    tolerances = (rms_tolerance, coverage_tolerance, coverage_tolerance)
    found = []
    for group in GROUPS:
        orbits = [record[group] for record in records if record[group]["n"]]
        if len(orbits) < _MIN_ORBITS:
            continue
        every = zip(names, tolerances, figures(orbits, "marginal"), strict=True)
        for name, tolerance, one in every:
            if one.off > tolerance and one.off > 3.0 * one.error:
                found.append(
                    f"{group}: {name} {one.value:.3f} ± {one.error:.3f}, expected {one.expected}"
                )
    return found


def markdown(rows: pd.DataFrame) -> str:
    """Return a table as Markdown."""
    lines = [list(rows.columns), ["---"] * len(rows.columns), *rows.astype(str).values.tolist()]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
