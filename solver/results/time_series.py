"""Time series: statistics over the orbits of a survey, for each source and for all.

Paper, section "Time-series" and Fig. "discussion:test:rms".
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float, Int

from solver.data.survey_schema import ERRORS_BY_COUNT, MOTION_PARAMETERS, MOTIONS
from solver.model.apparent_motion import N_PARAMETERS, julian_year
from solver.results.motion import MotionFit, fit_motions
from solver.results.shared_errors import draws_of

_AXES = ("ra", "dec")
# Minimum number of samples of a mean square.
_MIN_SAMPLES = 10


def motion_table(history: pd.DataFrame, epoch: float) -> pd.DataFrame:
    """Return `survey_schema.MOTIONS`; arguments as for `solver.results.motion.fit_motions`."""
    fit = fit_motions(history, epoch)
    count = np.diff(fit.first, append=len(history))
    first_rows = history.iloc[fit.first]
    years = julian_year(history["epoch"].to_numpy())
    columns: dict[str, object] = {
        "source_id": fit.source_id,
        "is_reference": first_rows["is_reference"].to_numpy(bool),
        "is_artificial": first_rows["is_artificial"].to_numpy(bool),
        "n_orbits": count,
        "n_obs": np.add.reduceat(history["n_obs"].to_numpy(), fit.first),
        "span": years[fit.first + count - 1] - years[fit.first],
        "epoch": np.full(len(count), epoch),
        **_parameter_columns(fit),
        "chi2": np.where(np.isnan(fit.motion[:, 0]), np.nan, fit.chi2),
        "dof": 2 * count - N_PARAMETERS,
        **_scatter(fit, count),
        **_deviation(history, fit, count),
        **_separations(history, fit.first, count),
    }
    return pd.DataFrame(columns)[MOTIONS.names]


class _Sums(NamedTuple):
    """Cumulative sums over all rows of the history."""

    error: Float[np.ndarray, "n 2"]
    noise: Float[np.ndarray, "n 2"]
    drawn: Float[np.ndarray, "n draw 2"]


def errors_by_count(history: pd.DataFrame, counts: list[int]) -> pd.DataFrame:
    """Return `survey_schema.ERRORS_BY_COUNT`: the error as a function of the orbits averaged.

    The orbits of each source, in order of time, are divided into groups of N; the error is the
    mean position of a group minus the truth.

    Parameters
    ----------
    history : history of the sources, as for `solver.results.motion.fit_motions`, with truth
    counts : values of N
    """
    first = np.unique(history["source_id"].to_numpy(), return_index=True)[1]
    error = _deviations(history)
    variance = history[["sigma_ra_noise", "sigma_dec_noise"]].to_numpy() ** 2
    sums = _Sums(*(_running(values) for values in (error, variance, draws_of(history))))
    rows = [_errors_of(sums, first, len(history), count) for count in counts]
    return pd.DataFrame([row for row in rows if row is not None], columns=ERRORS_BY_COUNT.names)


def _running(values: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Return the sum of all rows before each row, and of all rows."""
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])


def _errors_of(
    sums: _Sums, first: Int[np.ndarray, " src"], n_rows: int, count: int
) -> tuple[int | float, ...] | None:
    length = np.diff(first, append=n_rows)
    groups = length // count
    begin = np.repeat(first, groups) + count * (
        np.arange(groups.sum()) - np.repeat(np.cumsum(groups) - groups, groups)
    )
    if len(begin) < _MIN_SAMPLES:
        return None
    error, noise, drawn = (total[begin + count] - total[begin] for total in sums)
    measured = float(np.mean((error / count) ** 2))
    noise_square = float(np.mean(noise) / count**2)
    # One value for each draw of the catalogue errors; the real errors are a single draw.
    floors = np.mean((drawn / count) ** 2, axis=(0, 2))
    expected = noise_square + float(floors.mean())
    spread = np.sqrt(2.0 * noise_square**2 / error.size + float(floors.var()))
    sigma = 0.5 * spread / np.sqrt(expected)
    root = np.sqrt(measured)
    floor = float(np.sqrt(floors.mean()))
    numbers = (root, max(root - sigma, 0.0), root + sigma, np.sqrt(expected), np.sqrt(noise_square))
    return (count, int((groups > 0).sum()), *map(float, numbers), floor)


def _parameter_columns(fit: MotionFit) -> dict[str, Float[np.ndarray, " src"]]:
    noise, shared = (np.diagonal(c, axis1=1, axis2=2) for c in (fit.noise, fit.catalogue))
    sigma = np.sqrt(noise + shared)
    by_prefix = {
        "fit": fit.motion,
        "sigma_noise": np.sqrt(noise),
        "sigma_catalogue": np.sqrt(shared),
        "sigma": sigma,
        "true": fit.true,
        "pull": (fit.motion - fit.true) / sigma,
    }
    return {
        f"{prefix}_{name}": values[:, i]
        for prefix, values in by_prefix.items()
        for i, name in enumerate(MOTION_PARAMETERS)
    }


def _scatter(fit: MotionFit, count: Int[np.ndarray, " src"]) -> dict[str, np.ndarray]:
    """Return the scatter about the motion, counting half of the parameters per coordinate."""
    freedom = np.where(count > N_PARAMETERS / 2, count - N_PARAMETERS / 2, np.nan)[:, None]
    measured, expected = (
        np.sqrt(np.add.reduceat(values, fit.first) / freedom)
        for values in (fit.residual**2, fit.expected)
    )
    return _by_axis("scatter", measured) | _by_axis("expected_scatter", expected)


def _deviation(
    history: pd.DataFrame, fit: MotionFit, count: Int[np.ndarray, " src"]
) -> dict[str, np.ndarray]:
    n = count[:, None]
    variance = history[["sigma_ra_noise", "sigma_dec_noise"]].to_numpy() ** 2
    noise_square = np.add.reduceat(variance, fit.first) / n**2
    mean_draws = np.add.reduceat(fit.drawn, fit.first) / n[:, None]
    expected = np.sqrt(noise_square + np.mean(mean_draws**2, axis=1))
    mean = np.add.reduceat(_deviations(history), fit.first) / n
    return _by_axis("mean_deviation", mean) | _by_axis("expected_deviation", expected)


def _separations(
    history: pd.DataFrame, first: Int[np.ndarray, " src"], count: Int[np.ndarray, " src"]
) -> dict[str, np.ndarray]:
    columns = {}
    for name, separation in (
        ("truth", _deviations(history)),
        ("catalogue", history[["offset_ra", "offset_dec"]].to_numpy()),
    ):
        squares = np.add.reduceat(separation**2, first) / count[:, None]
        columns |= _by_axis(f"rms_{name}", np.sqrt(squares))
        columns[f"rms_{name}_2d"] = np.sqrt(squares.sum(axis=1))
    return columns


def _deviations(history: pd.DataFrame) -> Float[np.ndarray, "row 2"]:
    """Return estimate minus truth, mas."""
    offset, true = (
        history[[f"{prefix}_{axis}" for axis in _AXES]].to_numpy()
        for prefix in ("offset", "true_offset")
    )
    return offset - true


def _by_axis(name: str, values: Float[np.ndarray, "src 2"]) -> dict[str, np.ndarray]:
    return {f"{name}_{axis}": values[:, i] for i, axis in enumerate(_AXES)}
