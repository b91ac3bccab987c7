"""A small synthetic fitted survey with realistic statistics, made with NumPy: nothing is fitted."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data import schema, survey_schema
from solver.data.survey_schema import MOTION_PARAMETERS
from solver.model.apparent_motion import julian_year, motion_design
from solver.model.astrometry import frames_at, sky_position
from solver.model.directions import offsets_mas
from solver.model.ephemeris import observer_at
from solver.simulate.sky import galactic_to_icrs
from solver.units import MAS_PER_DEG

FIRST_ID = 4_057_482_027_171_038_209
EPOCH = 2029.0
FAILED = (11, 12)
NOISE_MAS = {True: 0.03, False: 0.66}
SHARED_MAS = {True: 0.09, False: 0.06}
_ASTROMETRY = ("ra", "dec", "parallax", "pmra", "pmdec")
_ERRORS = {True: (0.02, 0.018, 0.02, 0.021, 0.018), False: (1000.0, 1000.0, 1.0, 1.0, 1.0)}
_SEASONS = (61841.0, 62007.0, 62206.0, 62372.0, 62571.0, 62737.0)


class SurveySample(NamedTuple):
    """The tables of a fitted survey (`solver.data.survey_schema`, `solver.data.schema`)."""

    orbits: pd.DataFrame
    motions: pd.DataFrame
    history: pd.DataFrame
    catalogue: pd.DataFrame
    truth: pd.DataFrame

    def source(self, kind: str, number: int = 0) -> tuple[pd.DataFrame, pd.Series]:
        """Return history and motion of one "reference", "artificial" or "other" source."""
        rows = self.motions
        chosen = {
            "reference": rows["is_reference"],
            "artificial": rows["is_artificial"],
            "other": ~rows["is_reference"] & ~rows["is_artificial"],
        }[kind]
        motion = rows[chosen].sort_values("n_orbits", ascending=False).iloc[number]
        history = self.history[self.history["source_id"] == motion["source_id"]]
        return history.reset_index(drop=True), motion


def synthetic_survey(
    *, n_orbits: int = 90, n_reference: int = 24, n_artificial: int = 12, n_other: int = 36
) -> SurveySample:
    """Return a survey of which two orbits failed and one is missing."""
    random = np.random.default_rng(7)
    counts = (n_reference, n_artificial, n_other)
    truth = _truth(random, *counts)
    catalogue = _catalogue(random, truth)
    orbits = _orbits(random, n_orbits, sum(counts))
    complete = orbits[orbits["status"] == "complete"]
    mjd = complete["epoch"].to_numpy()
    listed, true = places(catalogue, mjd), places(truth, mjd)
    histories, motions = [], []
    for row in range(len(truth)):
        # The last source is measured once, the first in every orbit.
        share = 1.0 - row / len(truth)
        seen = random.random(len(complete)) < share
        seen = np.flatnonzero(seen | (row == 0)) if row < len(truth) - 1 else np.array([0])
        at = complete.iloc[seen]
        history = _history(random, catalogue.iloc[row], at, listed[seen, row], true[seen, row])
        histories.append(history)
        motions.append(_motion(history, catalogue.iloc[row], truth.iloc[row]))
    return SurveySample(
        orbits,
        pd.DataFrame(motions)[survey_schema.MOTIONS.names].astype(
            {"source_id": "int64", "is_reference": bool, "is_artificial": bool}
        ),
        pd.concat(histories, ignore_index=True),
        catalogue,
        truth,
    )


def _truth(
    random: np.random.Generator, n_reference: int, n_artificial: int, n_other: int
) -> pd.DataFrame:
    n = n_reference + n_artificial + n_other
    number = np.arange(n)
    artificial = (number >= n_reference) & (number < n_reference + n_artificial)
    spread = np.where(artificial, 0.3, 1.0)
    ra, dec = galactic_to_icrs(
        -0.3 + spread * random.uniform(-1, 1, n), 0.1 + 0.6 * spread * random.uniform(-1, 1, n)
    )
    moving = ~artificial
    table = pd.DataFrame(
        {
            "source_id": FIRST_ID + 7 * number,
            "ra": ra,
            "dec": dec,
            "pmra": moving * random.normal(-2.0, 4.0, n),
            "pmdec": moving * random.normal(-3.0, 4.0, n),
            "parallax": moving * random.uniform(0.2, 2.0, n),
            "ref_epoch": 2016.0,
            "is_reference": number < n_reference,
            "is_artificial": artificial,
        }
    )
    errors = {f"{name}_error": 0.02 for name in _ASTROMETRY}
    return table.assign(magnitude=np.nan, **errors)[schema.TRUTH.names]


def _catalogue(random: np.random.Generator, truth: pd.DataFrame) -> pd.DataFrame:
    sigma = np.array([_ERRORS[bool(is_reference)] for is_reference in truth["is_reference"]])
    drawn = sigma * random.standard_normal(sigma.shape)
    table = truth.assign(**{n.name: 0.0 for n in schema.CATALOGUE if n.name.endswith("_corr")})
    table["ra"] += drawn[:, 0] / MAS_PER_DEG / np.cos(np.radians(table["dec"]))
    table["dec"] += drawn[:, 1] / MAS_PER_DEG
    for column, name in enumerate(_ASTROMETRY):
        table[f"{name}_error"] = sigma[:, column]
        if column > 1:
            table[name] += drawn[:, column]
    return table[schema.CATALOGUE.names]


def _orbits(random: np.random.Generator, n_orbits: int, n_sources: int) -> pd.DataFrame:
    number = np.arange(n_orbits)
    season = number * len(_SEASONS) // n_orbits
    days = 45.0 * (number * len(_SEASONS) / n_orbits - season)
    dof = random.integers(480_000, 560_000, n_orbits).astype(float)
    table = pd.DataFrame(
        {
            "orbit_id": number,
            "status": "complete",
            "message": "",
            "state": "good",
            "epoch": np.take(_SEASONS, season) + days,
            "converged": 1.0,
            "iterations": 3.0,
            "n_measurements": 0.5 * dof + 7000.0,
            "n_sources": float(n_sources),
            "n_reference": 24.0,
            "chi2_per_dof": 1.0 + np.sqrt(2.0 / dof) * random.standard_normal(n_orbits),
            "dof": dof,
            "residual_rms_x": 0.0099,
            "residual_rms_y": 0.0099,
            "normalised_deviation_ra": random.normal(0.34, 0.03, n_orbits),
            "normalised_deviation_dec": random.normal(0.33, 0.03, n_orbits),
            "expected_normalised_deviation_ra": random.normal(0.34, 0.003, n_orbits),
            "expected_normalised_deviation_dec": random.normal(0.33, 0.003, n_orbits),
            "normalised_deviation_dof_ra": random.normal(25.0, 1.0, n_orbits),
            "normalised_deviation_dof_dec": random.normal(25.0, 1.0, n_orbits),
            "mean_error_ra": 0.03,
            "mean_error_dec": 0.03,
            "seconds": random.uniform(3.0, 4.0, n_orbits),
        }
    )[survey_schema.RUN_ORBITS.names]
    figures = table.columns.difference(["orbit_id", "status", "message", "state"])
    table.loc[table["orbit_id"].isin(FAILED), figures] = np.nan
    table.loc[table["orbit_id"].isin(FAILED), ["status", "message", "state"]] = [
        *("failed", "not finite", "")
    ]
    table.loc[n_orbits - 1, figures] = np.nan
    table.loc[n_orbits - 1, ["status", "state"]] = ["missing", ""]
    return table


def places(catalogue: pd.DataFrame, mjd: np.ndarray) -> np.ndarray:
    """Return RA and Dec, deg, of a catalogue at some times, shape (time, source, 2)."""
    positions = observer_at(mjd).position
    frames = [frames_at(catalogue, t, at) for t, at in zip(mjd, positions, strict=True)]
    return np.stack([np.stack(sky_position(frame[:, 0]), axis=-1) for frame in frames])


def _history(
    random: np.random.Generator,
    source: pd.Series,
    seen: pd.DataFrame,
    listed: np.ndarray,
    true: np.ndarray,
) -> pd.DataFrame:
    is_reference = bool(source["is_reference"])
    noise, shared = NOISE_MAS[is_reference], SHARED_MAS[is_reference]
    mjd = seen["epoch"].to_numpy()
    true_offset = np.stack(offsets_mas(*true.T, *listed.T), axis=-1)
    # Estimates of reference sources stay near the prior, those of other sources near the truth.
    error = shared * random.standard_normal(2) + noise * random.standard_normal((len(mjd), 2))
    offset = error + (0.1 if is_reference else 1.0) * true_offset
    dec = listed[:, 1] + offset[:, 1] / MAS_PER_DEG
    sigma = float(np.hypot(noise, shared))
    prior = _ERRORS[is_reference]
    columns = {
        "source_id": int(source["source_id"]),
        "orbit_id": seen["orbit_id"].to_numpy(),
        "epoch": mjd,
        "is_reference": is_reference,
        "is_artificial": bool(source["is_artificial"]),
        "n_obs": random.integers(24, 49, len(mjd)),
        "ra": listed[:, 0] + offset[:, 0] / MAS_PER_DEG / np.cos(np.radians(dec)),
        "dec": dec,
        "offset_ra": offset[:, 0],
        "offset_dec": offset[:, 1],
        "prior_sigma_ra": np.hypot(prior[0], 13.0 * prior[3]),
        "prior_sigma_dec": np.hypot(prior[1], 13.0 * prior[4]),
        "true_offset_ra": true_offset[:, 0],
        "true_offset_dec": true_offset[:, 1],
        "chi2": 72.0,
        "dof": 72.0,
    }
    kinds = {"conditional": noise, "marginal": sigma, "noise": noise, "catalogue": shared}
    for kind, value in kinds.items():
        columns |= {f"sigma_ra_{kind}": value, f"sigma_dec_{kind}": value, f"corr_{kind}": 0.0}
    return pd.DataFrame(columns)[survey_schema.HISTORY.names]


def _motion(history: pd.DataFrame, catalogue: pd.Series, truth: pd.Series) -> dict[str, object]:
    is_reference = bool(catalogue["is_reference"])
    noise, shared = NOISE_MAS[is_reference], SHARED_MAS[is_reference]
    n, mjd = len(history), history["epoch"].to_numpy()
    offset, true = (
        np.stack([history[f"{p}offset_ra"], history[f"{p}offset_dec"]]) for p in ("", "true_")
    )
    error = offset - true
    row: dict[str, object] = {
        "source_id": catalogue["source_id"],
        "is_reference": is_reference,
        "is_artificial": bool(catalogue["is_artificial"]),
        "n_orbits": n,
        "n_obs": int(history["n_obs"].sum()),
        "span": float(np.ptp(julian_year(mjd))),
        "epoch": EPOCH,
        "dof": 2 * n - 5 if n > 3 else 0,
        "rms_truth_2d": float(np.sqrt(np.mean(error**2) * 2.0)),
        "rms_catalogue_2d": float(np.sqrt(np.mean(offset**2) * 2.0)),
    }
    row |= _fit(history, catalogue, truth, noise, shared)
    for axis, name in enumerate(("ra", "dec")):
        spread = float(offset[axis].std(ddof=1)) if n > 3 else np.nan
        row |= {
            f"scatter_{name}": spread if is_reference else float(error[axis].std()),
            f"expected_scatter_{name}": noise,
            f"mean_deviation_{name}": float(error[axis].mean()),
            f"expected_deviation_{name}": float(np.hypot(0.3 if is_reference else shared, noise)),
            f"rms_truth_{name}": float(np.sqrt(np.mean(error[axis] ** 2))),
            f"rms_catalogue_{name}": float(np.sqrt(np.mean(offset[axis] ** 2))),
        }
    return row


def _fit(
    history: pd.DataFrame, catalogue: pd.Series, truth: pd.Series, noise: float, shared: float
) -> dict[str, float]:
    """Return the columns of the five-parameter fit; NaN where there are too few orbits."""
    design = motion_design(
        float(catalogue["ra"]), float(catalogue["dec"]), history["epoch"].to_numpy(), EPOCH
    ).reshape(-1, 5)
    offset = history[["offset_ra", "offset_dec"]].to_numpy().reshape(-1)
    years = EPOCH - 2016.0
    places = (one[name] for one in (truth, catalogue) for name in ("ra", "dec"))
    d_ra, d_dec = (offset.item() for offset in offsets_mas(*places))
    d_plx, d_pmra, d_pmdec = (float(truth[n] - catalogue[n]) for n in _ASTROMETRY[2:])
    true = np.array([d_ra + years * d_pmra, d_dec + years * d_pmdec, d_plx, d_pmra, d_pmdec])
    fit, sigma_noise, chi2 = np.full(5, np.nan), np.full(5, np.nan), np.nan
    if len(history) > 3:
        fit = np.linalg.lstsq(design, offset, rcond=None)[0]
        sigma_noise = noise * np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
        chi2 = float(np.sum((offset - design @ fit) ** 2)) / noise**2
    sigma_catalogue = shared * np.array([1.0, 1.0, 0.1, 0.1, 0.1]) + 0.0 * sigma_noise
    sigma = np.hypot(sigma_noise, sigma_catalogue)
    columns = {
        "fit": fit,
        "sigma_noise": sigma_noise,
        "sigma_catalogue": sigma_catalogue,
        "sigma": sigma,
        "true": true,
        "pull": (fit - true) / sigma,
    }
    return {"chi2": chi2} | {
        f"{kind}_{name}": float(value)
        for kind, values in columns.items()
        for name, value in zip(MOTION_PARAMETERS, values, strict=True)
    }
