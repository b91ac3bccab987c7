"""Rows that stand for all: those from which the covariance of the patterns is computed."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float
from numpy.polynomial import legendre

from solver.results.diagnosis.rows import Camera, Rows

# Measurements and sources of a sample: more of them hardly change its sums.
_MOST_ROWS, _MOST_SOURCES = 12_000, 1_800
# Exposures of each span, and in all, where these are more measurements than that.
_LEAST_EXPOSURES, _LEAST_IN_ALL = 2, 8
# Measurements of a sample that has all exposures.
_MOST_OF_ALL_EXPOSURES = 60_000
# Of sums of weights, relative.
_ROUNDING = 1e-9
# Bits of a coordinate in the order of the sources.
_BITS = 10


class Sample(NamedTuple):
    """A part of the rows that stands for all.

    Attributes
    ----------
    parts : all of the sample; if it does not have all sources, two halves of it
    camera : with the times at which the exposures of the sample stand for all
    weight : of all rows, um^-2
    share : of all sources that the sample has
    """

    parts: Sequence[Rows]
    camera: Camera
    weight: float
    share: float


def sample_of(
    rows: Rows, camera: Camera, sources: pd.DataFrame, *, all_exposures: bool = False
) -> Sample:
    """Return a sample.

    A source stays at one place of the focal plane while a field is exposed. So few exposures of
    each field, or of each span of it, have nearly all that the data say, if each is given the time
    and the weight of a Gauss quadrature: sums over all exposures of what changes smoothly are then
    exact. Those of most weight are taken, since the noise may differ between exposures. What counts
    are the sources: of these, as many are taken as there is time for, evenly spread over the sky.

    Parameters
    ----------
    sources : of the result
    all_exposures : of few sources then; for what depends on the time in detail
    """
    some, camera = (rows, camera) if all_exposures else _heaviest_exposures(rows, camera)
    weight, counts = float(some.weight.sum()), np.bincount(some.source, minlength=len(sources))
    if all_exposures:
        step = some.n / _MOST_OF_ALL_EXPOSURES
    else:
        step = max(some.n / _MOST_ROWS, np.count_nonzero(counts) / _MOST_SOURCES)
    if step <= 1.0:
        return Sample([some], camera, weight, 1.0)
    order = _along_the_sky(sources)
    order = order[counts[order] > 0]
    taken = order[_at_steps(len(order), step)]
    parts = [_of_sources(some, half, len(sources)) for half in (taken[::2], taken[1::2])]
    exposures = [np.flatnonzero(np.diff(part.first)) for part in (some, *parts)]
    if not all(np.array_equal(exposures[0], of_part) for of_part in exposures[1:]):
        parts = [_of_sources(some, taken, len(sources))]
    return Sample(parts, camera, weight, 1.0 / step)


def _heaviest_exposures(rows: Rows, camera: Camera) -> tuple[Rows, Camera]:
    """Return the rows of some exposures, with the weights and times at which they stand for all."""
    spans = int(camera.span.max()) + 1
    each = int(_MOST_ROWS / max(rows.n, 1) * len(camera.time) / spans)
    count = max(each, _LEAST_EXPOSURES, -(-_LEAST_IN_ALL // spans))
    of_exposure = rows.in_exposures(rows.weight)
    factor, time = np.zeros(len(camera.time)), camera.time.copy()
    for span in np.unique(camera.span):
        of_span = np.flatnonzero((camera.span == span) & (of_exposure > 0.0))
        of_span = of_span[np.argsort(camera.time[of_span], kind="stable")]
        if len(np.unique(camera.time[of_span])) <= count:
            factor[of_span] = 1.0
            continue
        nodes = gauss_quadrature(camera.time[of_span], of_exposure[of_span], count)
        for group, node, weight in zip(np.array_split(of_span, count), *nodes, strict=True):
            # The first of equal ones: their sums differ by rounding, with the order of the rows.
            is_heavy = of_exposure[group] >= (1.0 - _ROUNDING) * of_exposure[group].max()
            heaviest = group[np.argmax(is_heavy)]
            time[heaviest], factor[heaviest] = node, weight / of_exposure[heaviest]
    parts = [np.arange(*rows.first[e : e + 2]) for e in np.flatnonzero(factor)]
    some = rows.of(np.concatenate([np.empty(0, dtype=np.intp), *parts]))
    # All times are the same, with a single exposure among them.
    rate = np.ptp(camera.phase) / max(float(np.ptp(camera.time)), 1e-12)
    phase = camera.phase + rate * (time - camera.time)
    some = some._replace(weight=some.weight * factor[some.exposure])
    return some, camera._replace(time=time, phase=phase)


def gauss_quadrature(
    time: Float[np.ndarray, " n"], weight: Float[np.ndarray, " n"], count: int
) -> tuple[Float[np.ndarray, " node"], Float[np.ndarray, " node"]]:
    """Return `count` times, ascending, and their weights: a Gauss quadrature of a discrete measure.

    Weighted sums of polynomials up to degree 2 `count` - 1 are the same as over the given times
    (Golub and Welsch, Mathematics of Computation 23, 221, 1969).

    Parameters
    ----------
    time, weight : more than `count` different times, and their positive weights
    """
    middle, half = 0.5 * (time.max() + time.min()), 0.5 * np.ptp(time)
    within, root = (time - middle) / half, np.sqrt(weight)
    # Orthonormal polynomials, of which the first is constant.
    basis, _ = np.linalg.qr(root[:, None] * legendre.legvander(within, count - 1))
    nodes, vectors = np.linalg.eigh(basis.T @ (within[:, None] * basis))
    return middle + half * nodes, float(weight.sum()) * vectors[0] ** 2


def _at_steps(count: int, step: float) -> np.ndarray:
    """Return whole numbers below `count` at equal steps, from zero."""
    places = np.arange(0.0, count, step).astype(np.intp)
    # By rounding, the last one may be the end itself.
    return places[places < count]


def _of_sources(rows: Rows, sources: np.ndarray, n_sources: int) -> Rows:
    chosen = np.zeros(n_sources, dtype=bool)
    chosen[sources] = True
    return rows.of(np.flatnonzero(chosen[rows.source]))


def _along_the_sky(sources: pd.DataFrame) -> np.ndarray:
    """Return the order of the sources along a curve that fills the sky, reference sources last.

    Any few of them at equal steps are spread evenly. The curve is Morton's: the bits of both
    coordinates in turn.
    """
    dec = sources["dec"].to_numpy(float)
    # The range of right ascension may include zero.
    along = (sources["ra"].to_numpy(float) - sources["ra"].iloc[0] + 180.0) % 360.0
    sky = np.stack([along * np.cos(np.radians(dec.mean())), dec])
    sky -= sky.min(axis=1, keepdims=True)
    steps = (sky * ((2**_BITS - 1) / max(float(sky.max()), 1e-300))).astype(np.int64)
    bits = 2 * np.arange(_BITS)
    code = sum(
        ((one[:, None] >> np.arange(_BITS)) & 1) @ (1 << (bits + n)) for n, one in enumerate(steps)
    )
    return np.lexsort((code, sources["is_reference"].to_numpy(bool)))
