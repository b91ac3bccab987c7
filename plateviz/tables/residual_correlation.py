"""Table of the correlation of the residual field in E and B parts, and its summary.

As in weak lensing, but for vectors: with w = u + iv of two measurements of one exposure and the
direction phi from one to the other, xi_+ is the mean of Re(w_1 w_2*) and xi_- that of
Re(w_1 w_2 exp(-2i phi)) at their separation r. The parts of a gradient (E) and of a curl (B) are

    xi_E,B(r) = (xi_+(r) +- [xi_-(r) - 2 int_r^inf xi_-(s) ds / s]) / 2,

because J0(x) = 2 int_x^inf J2(s) ds / s - J2(x).
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import fft

from plateviz.tables.chance import largest_by_chance
from plateviz.tables.focal_residuals import FocalResiduals, focal_residuals
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.units import UM_PER_MM

# Cells along the focal plane; twice as many, with zeros around, are a fast length for an FFT.
_CELLS = 80
# For fewer cells, the direction from one to the other is not that of their measurements.
_FEWEST_CELLS = 3
# Exposures transformed at once: few, so that they stay in the cache.
_AT_ONCE = 8
_LEAST_PAIRS, _MOST_ABSORBED, _TINY = 1e-4, 0.9, 1e-30


class _Sums(NamedTuple):
    """Sums over the pairs of cells at each offset, shape (2 cells, 2 cells).

    Attributes
    ----------
    pairs : products of the free weights
    plus, minus : products of the weighted residuals, as in xi_+ and xi_-
    absorbed : those of `plus` that are expected because the pointings are fitted
    """

    pairs: np.ndarray
    plus: np.ndarray
    minus: np.ndarray
    absorbed: np.ndarray


def residual_correlation(
    result: FitResult, instrument: Instrument, *, bins: int = 12
) -> pd.DataFrame:
    """Return the E and B parts of the correlation of the residuals against separation.

    All pairs of measurements of each exposure are counted, over 300 million in a full orbit:
    residuals and weights are summed in the cells of a grid, 80 along the focal plane, and
    correlated by FFT. That takes a fifth of a second; a random subset of pairs that is as fast
    would have about ten times the noise. Separations begin at three cells and end at the side of
    the focal plane, and so does the integral: a field with longer waves would leak between E and
    B, but pointings and distortion absorb it.

    Residuals are weighted by the inverse variance of the measurement and divided by the share
    that the fit leaves. Pointing, roll and focal length of an exposure are fitted, so that the
    products have a small negative mean by chance, which is subtracted. The sigmas follow from the
    weights of the pairs, because the products of independent errors are uncorrelated.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the order of the detectors and the size of the focal plane
    bins : number of bins of separation, of one width in log scale

    Returns
    -------
    A row per bin with pairs: `low_mm`, `high_mm`, `separation_mm` (mean), `separation_arcmin`,
    `xi_plus`, `xi_minus` and their `sigma_xi` by chance, `e`, `b` and their `sigma` by chance
    (mpix^2), `pull_e`, `pull_b` (over sigma), and `mas_per_mpix` (the same in all rows)
    """
    found = focal_residuals(result, instrument)
    half = max(np.abs(d.corners_um()).max() for d in instrument.detectors) / UM_PER_MM
    sums = _sums(found, half, len(result.exposures))
    edges = np.geomspace((_FEWEST_CELLS - 0.5) * 2.0 * half / _CELLS, 2.0 * half, bins + 1)
    table = _in_bins(sums, half, edges)
    # The residuals of a source in several exposures are correlated by the fit of its position, and
    # so are the products of a pair that is measured again.
    absorbed = float(found.leverage.sum()) / max(len(found), 1)
    table["sigma_xi"] /= np.sqrt(1.0 - min(absorbed, _MOST_ABSORBED))
    table.insert(3, "separation_arcmin", table["separation_mm"] * found.arcmin_per_mm)
    return _with_parts(table).assign(mas_per_mpix=found.mas_per_mpix)


class CorrelationStatistics(NamedTuple):
    """Summary of a table of `residual_correlation`.

    Attributes
    ----------
    largest_e, largest_b : largest absolute value over its sigma
    limit : what the largest of all exceeds in 1 % of fields by chance
    least_sigma_mpix2 : smallest sigma
    least_sigma_mas : its square root on the sky
    """

    largest_e: float
    largest_b: float
    limit: float
    least_sigma_mpix2: float
    least_sigma_mas: float


def correlation_statistics(table: pd.DataFrame) -> CorrelationStatistics:
    """Return the summary of a table of `residual_correlation` that is not empty."""
    sigma = float(table["sigma"].min())
    return CorrelationStatistics(
        largest_e=float(table["pull_e"].abs().max()),
        largest_b=float(table["pull_b"].abs().max()),
        limit=largest_by_chance(2 * len(table)),
        least_sigma_mpix2=sigma,
        least_sigma_mas=float(np.sqrt(sigma) * table["mas_per_mpix"].iloc[0]),
    )


def _sums(found: FocalResiduals, half: float, n_exposures: int) -> _Sums:
    """Return the sums over all exposures; `half` is half the side of the focal plane, mm."""
    weight = 2.0 / (1.0 / found.weight).sum(axis=1)
    edge, shape = 2.0 * half / _CELLS, (n_exposures, _CELLS, _CELLS)
    column, row = np.clip(np.floor((found.at + half) / edge), 0, _CELLS - 1).astype(np.int64).T
    index = np.ravel_multi_index((found.exposure, row, column), shape)
    free, u, v = (
        np.bincount(index, values, minlength=np.prod(shape)).reshape(shape).astype(np.float32)
        for values in (weight * (1.0 - found.leverage), *(weight * found.vector.T))
    )
    places = _places(free, edge)
    sums = np.zeros((4, 2 * _CELLS, 2 * _CELLS), dtype=complex)
    for first in range(0, n_exposures, _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        field, weights = _transformed(u[some] + 1j * v[some]), _transformed(free[some])
        power = np.square(np.abs(weights))
        sums[0] += power.sum(axis=0)
        sums[1] += np.square(np.abs(field)).sum(axis=0)
        # Without the conjugate, the transform of one factor is mirrored.
        sums[2] += (field * np.roll(field[:, ::-1, ::-1], 1, axis=(1, 2))).sum(axis=0)
        # Two shifts, a turn and a change of scale are fitted to each exposure.
        of_shift = power / np.maximum(free[some].sum(axis=(1, 2)), _TINY)[:, None, None]
        of_turn = np.square(np.abs(_transformed(free[some] * places[some])))
        sums[3] -= 2.0 * (of_shift + of_turn).sum(axis=0)
    pairs, plus, minus, absorbed = fft.ifft2(sums)
    return _Sums(pairs.real, plus.real, minus, absorbed.real)


def _places(free: np.ndarray, edge: float) -> np.ndarray:
    """Return x + iy of the cells about the centre of each exposure, with a sum of squares of one.

    Parameters
    ----------
    free : free weights of the cells, shape (exposures, cells, cells)
    edge : side of a cell, mm
    """
    along = (np.arange(_CELLS) * edge).astype(np.float32)
    place = along + 1j * along[:, None]
    total = np.maximum(free.sum(axis=(1, 2)), _TINY)
    place = place - ((free * place).sum(axis=(1, 2)) / total)[:, None, None]
    squares = (free * np.square(np.abs(place))).sum(axis=(1, 2))
    # An exposure with a single filled cell has no turn.
    scale = np.where(squares > total * (0.1 * edge) ** 2, squares, np.inf)
    return place / np.sqrt(scale)[:, None, None]


def _transformed(grids: np.ndarray) -> np.ndarray:
    """Return the Fourier transforms of grids with as many cells of zeros appended on both axes."""
    # One axis after the other: most of the zeros are never transformed.
    return fft.fft(fft.fft(grids, 2 * _CELLS, axis=2), 2 * _CELLS, axis=1)


def _in_bins(sums: _Sums, half: float, edges: np.ndarray) -> pd.DataFrame:
    """Return the means over all pairs whose separation is between two successive edges, mm."""
    cells = 2 * _CELLS
    offset = fft.fftfreq(cells, 1.0 / cells) * (2.0 * half / _CELLS)
    between = offset + 1j * offset[:, None]
    separation = np.abs(between)
    number = np.digitize(separation, edges).ravel() - 1
    is_inside = (number >= 0) & (number < len(edges) - 1)
    # A pair is counted in both directions, which is the same in xi_+ and in xi_-.
    turned = sums.minus * np.exp(-2j * np.angle(between))
    pairs, plus, minus, weighted = (
        np.bincount(number[is_inside], values.ravel()[is_inside], minlength=len(edges) - 1)
        for values in (
            sums.pairs,
            sums.plus - sums.absorbed,
            turned.real,
            sums.pairs * separation,
        )
    )
    # Rounding leaves some weight at offsets without pairs; at zero, a cell is its own partner.
    has_pairs = pairs > _LEAST_PAIRS * sums.pairs[0, 0]
    pairs = pairs[has_pairs]
    return pd.DataFrame(
        {
            "low_mm": edges[:-1][has_pairs],
            "high_mm": edges[1:][has_pairs],
            "separation_mm": weighted[has_pairs] / pairs,
            "xi_plus": plus[has_pairs] / pairs,
            "xi_minus": minus[has_pairs] / pairs,
            # Half of the pairs are different ones, and each has two products.
            "sigma_xi": 2.0 / np.sqrt(pairs),
        }
    )


def _with_parts(table: pd.DataFrame) -> pd.DataFrame:
    """Add the E and B parts and their sigmas, from the bins of `_in_bins`."""
    steps = np.log(table["high_mm"] / table["low_mm"]).to_numpy()
    # The integral from the middle of a bin: half of its own, all of the later ones.
    integral = np.triu(np.tile(steps, (len(steps), 1)), 1) + 0.5 * np.diag(steps)
    kernel = np.eye(len(steps)) - 2.0 * integral
    plus, minus = table["xi_plus"].to_numpy(), kernel @ table["xi_minus"].to_numpy()
    variance = table["sigma_xi"].to_numpy() ** 2
    sigma = 0.5 * np.sqrt(variance + kernel**2 @ variance)
    parts = {"e": 0.5 * (plus + minus), "b": 0.5 * (plus - minus)}
    pulls = {f"pull_{name}": part / sigma for name, part in parts.items()}
    return table.assign(**parts, sigma=sigma, **pulls)
