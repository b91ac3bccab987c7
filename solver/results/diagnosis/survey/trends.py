"""Tests of the calibration of all orbits against time: trends, jumps and seasons.

The scatter between the orbits is the measure, so that the tests need no covariances and hold for a
focal length that differs from orbit to orbit.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float

from solver.results.diagnosis.rate import log_chance_normal, of_many, sigmas
from solver.results.diagnosis.test import Test

# With fewer orbits there is no scatter to compare with.
LEAST_ORBITS = 8
# So many orbits at least on each side of a jump, and in each season.
_LEAST_PART = 3
# Common errors of the reference stars turn the quadratic terms with the position angle.
NOT_SEASONAL = "distortion, degree 2"


class Series(NamedTuple):
    """One group of parameters in all orbits.

    Attributes
    ----------
    group : its name
    orbits : orbit_id
    labels, units : of the parameters
    time : from -1 to 1
    season : 1 where the position angle is that of the first orbit, else -1; 0 if all are alike
    values : of the parameters, NaN where an orbit lacks one
    """

    group: str
    orbits: tuple[int, ...]
    labels: tuple[str, ...]
    units: tuple[str, ...]
    time: Float[np.ndarray, " orbit"]
    season: Float[np.ndarray, " orbit"]
    values: Float[np.ndarray, "orbit parameter"]


class Trend(NamedTuple):
    """The parameter of a group that changes most significantly.

    Attributes
    ----------
    test : of the group, `size_um` NaN
    label, unit : of the parameter
    change : from the first to the last orbit, at the jump, or between the seasons
    orbit : orbit_id of the first orbit after a jump; None for the other tests
    """

    test: Test
    label: str
    unit: str
    change: float
    orbit: int | None = None


def all_series(calibrations: pd.DataFrame) -> Iterator[Series]:
    """Yield the groups of `run_schema.CALIBRATIONS` that have enough orbits."""
    for group, rows in calibrations.groupby("group", sort=False):
        table = rows.pivot_table(index="orbit_id", columns="label", values="value", sort=False)
        of_orbits = rows.drop_duplicates("orbit_id").set_index("orbit_id").loc[table.index]
        if len(table) < LEAST_ORBITS:
            continue
        units = rows.drop_duplicates("label").set_index("label").loc[table.columns, "unit"]
        epochs = of_orbits["epoch"].to_numpy()
        half = max(0.5 * float(np.ptp(epochs)), 1e-9)
        yield Series(
            str(group),
            tuple(int(orbit) for orbit in table.index),
            tuple(map(str, table.columns)),
            tuple(units),
            (epochs - 0.5 * (epochs.max() + epochs.min())) / half,
            _season(of_orbits["position_angle"].to_numpy()),
            table.to_numpy(),
        )


def trend_tests(series: Series) -> list[Trend]:
    """Return the tests of one group: a trend, a jump, and a change with the season."""
    usable = np.isfinite(series.values).all(axis=0) & (np.ptp(series.values, axis=0) > 0.0)
    has_seasons = bool(series.season.any())
    if not usable.any():
        return []
    # The mean, and the seasons where there are two; a trend is none of these.
    base = [np.ones(len(series.time))] + ([series.season] if has_seasons else [])
    found = [_trend(series, usable, base), _jump(series, usable, base)]
    if has_seasons and series.group != NOT_SEASONAL:
        found.append(_seasonal(series, usable, base[:1]))
    return found


def _season(angle: Float[np.ndarray, " orbit"]) -> Float[np.ndarray, " orbit"]:
    is_alike = np.cos(np.radians(angle - angle[0])) > 0.0
    few = min(is_alike.sum(), (~is_alike).sum())
    return np.where(is_alike, 1.0, -1.0) if few >= _LEAST_PART else np.zeros(len(angle))


def _trend(series: Series, usable: Bool[np.ndarray, " parameter"], base: list) -> Trend:
    chances, slopes = _chances(series.values[:, usable], base, series.time)
    best = int(np.argmin(chances))
    chance = of_many(float(chances[best]), len(chances))
    return _told(series, usable, "trend", best, chance, 2.0 * float(slopes[best]))


def _seasonal(series: Series, usable: Bool[np.ndarray, " parameter"], base: list) -> Trend:
    with_time = [*base, series.time]
    chances, slopes = _chances(series.values[:, usable], with_time, series.season)
    best = int(np.argmin(chances))
    chance = of_many(float(chances[best]), len(chances))
    return _told(series, usable, "season", best, chance, 2.0 * float(slopes[best]))


def _jump(series: Series, usable: Bool[np.ndarray, " parameter"], base: list) -> Trend:
    order = np.argsort(series.time)
    places = range(_LEAST_PART, len(order) - _LEAST_PART + 1)
    chances, changes = [], []
    for place in places:
        later = np.zeros(len(order))
        later[order[place:]] = 1.0
        chance, change = _chances(series.values[:, usable], base, later)
        chances.append(chance)
        changes.append(change)
    every = np.array(chances)
    at, best = np.unravel_index(int(np.argmin(every)), every.shape)
    chance = of_many(float(every[at, best]), every.size)
    change = float(changes[int(at)][best])
    orbit = series.orbits[int(order[places[int(at)]])]
    return _told(series, usable, "jump", int(best), chance, change, orbit)


def _chances(
    values: Float[np.ndarray, "orbit parameter"], base: list, shape: Float[np.ndarray, " orbit"]
) -> tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, " parameter"]]:
    """Return the logarithm of the chance of each parameter's share of a shape, and the share."""
    basis, _ = np.linalg.qr(np.stack(base, axis=1))
    left = shape - basis @ (basis.T @ shape)
    square = float(left @ left)
    if square < 1e-9 * float(shape @ shape):
        nothing = np.zeros(values.shape[1])
        return nothing, nothing
    rest = values - values.mean(axis=0)
    rest = rest - basis @ (basis.T @ rest)
    share = left @ rest / square
    scatter = np.square(rest - np.outer(left, share)).sum(axis=0)
    dof = len(values) - len(base) - 1
    t = share * np.sqrt(square * dof / np.maximum(scatter, 1e-300))
    # Wallace's normal deviate of the same chance as t.
    deviate = np.sqrt(dof * np.log1p(t**2 / dof)) * (8.0 * dof + 1.0) / (8.0 * dof + 3.0)
    return np.array([log_chance_normal(float(one)) for one in deviate]), share


def _told(
    series: Series,
    usable: Bool[np.ndarray, " parameter"],
    kind: str,
    best: int,
    chance: float,
    change: float,
    orbit: int | None = None,
) -> Trend:
    number = int(np.flatnonzero(usable)[best])
    sigma = sigmas(chance)
    test = Test(f"{kind} of {series.group}", kind, (), sigma, 0.0, 1.0, chance, sigma)
    return Trend(test, series.labels[number], series.units[number], change, orbit)
