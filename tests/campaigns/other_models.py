"""Measure the models of causes that the campaign of the verdict does not try.

    python tests/campaigns/other_models.py [--records FILE]

Each orbit has some 1,500 sources and a flaw that makes the pulls *without* the model. A flaw that
`plateviz simulate --defect` does not know is put into the measurements here. Some five seconds of a
core for each orbit and model. Trials are recorded; a stopped campaign goes on.
"""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np
from jaxtyping import Float

from plateviz.cache import keep_compilations
from solver.data.distortion_terms import terms
from solver.data.instrument import MINI_MOCK
from solver.data.magnitudes import faintness
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from solver.results.diagnosis.patterns import legendre_at
from solver.simulate.defects.distortion_terms import ORBITAL_PERIOD_S
from solver.units import PIX_PER_MPIX, SECONDS_PER_DAY
from tests.benchmarks.machine import write
from tests.campaigns.defects import (
    SETTINGS,
    applied_defect,
    defective_orbit,
    pulls,
    rms,
    sparse_orbit,
)
from tests.campaigns.trials import Record, run_trials
from tests.campaigns.true_causes import deviations, truth_of

# Of the seeds, so that no orbit is one of another campaign.
FIRST = 7000
_PER_CASE = 10_000
# Amplitudes: the drift is that of the campaign of the verdict, the others have a like effect.
DRIFT_UM, ORBITAL_UM, SHIFT_MPIX, OWN_UM, FLOOR_PIX = 0.425, 0.25, 5.0, 0.07, 0.0094
OWN_DEGREE = 3


class Case(NamedTuple):
    """A flaw and its model.

    Attributes
    ----------
    flaw : in words
    options : of `plateviz fit`, that switch the model on
    model : settings of the fit
    simulated : returns the orbit of a seed
    compared : returns the deviations of the model's parameters from the truth, sigmas, by the
        result and the seed
    orbits : with this flaw; more where stars share an error, so that pulls differ between orbits
    """

    flaw: str
    options: str
    model: Mapping[str, Any]
    simulated: Callable[[int], OrbitData]
    compared: Callable[[FitResult, int], np.ndarray]
    orbits: int = 20


def main() -> int:
    arguments = parse_arguments()
    keep_compilations()
    for place, case in enumerate(CASES):
        run_trials(arguments.records, numbers_of(place, case), trial, after=report)
    write(
        "\n| flaw | fit with | orbits | pulls without | pulls with "
        "| parameters | deviation over sigma |"
    )
    write("|---|---|---:|---:|---:|---:|---:|")
    for place, case in enumerate(CASES):
        write(row(case, run_trials(arguments.records, numbers_of(place, case), trial)))
    return 0


def numbers_of(place: int, case: Case) -> range:
    """Return the numbers of the trials of a case, by its place: those of its orbits' seeds."""
    first = _PER_CASE * place + FIRST
    return range(first, first + case.orbits)


def trial(number: int) -> Record:
    """Return the pulls of an orbit without and with the model, and how far it is from the truth."""
    place, seed = divmod(number, _PER_CASE)
    case = CASES[place]
    data = case.simulated(seed)
    without, found = fit_orbit(data), fit_orbit(data, settings=FitSettings(**case.model))
    compared = case.compared(found, seed)
    return {
        "converged": bool(found.summary["converged"]),
        "without": rms(pulls(without.sources, without.true_places)),
        "with": rms(pulls(found.sources, found.true_places)),
        "deviation": rms(compared),
        "parameters": compared.size,
    }


def row(case: Case, records: Sequence[Record]) -> str:
    """Return the line of the table for a case."""
    without, with_, deviation = (
        rms(np.array([record[name] for record in records]))
        for name in ("without", "with", "deviation")
    )
    parameters = int(np.median([record["parameters"] for record in records]))
    return (
        f"| {case.flaw} | `{case.options}` | {len(records)} | {without:.2f} | {with_:.3f} "
        f"| {parameters} | {deviation:.2f} |"
    )


def report(number: int, record: Record) -> None:
    """Print one line about a trial."""
    place, seed = divmod(number, _PER_CASE)
    write(f"{CASES[place].options}, seed {seed}: {record}")


def drifting(seed: int) -> OrbitData:
    """Return an orbit whose quadratic distortion drifts."""
    return sparse_orbit(seed, (f"distortion-drift={DRIFT_UM}um",))


def oscillating(seed: int) -> OrbitData:
    """Return an orbit whose quadratic distortion oscillates."""
    return sparse_orbit(seed, (f"distortion-orbital={ORBITAL_UM}um",))


def walk_of_drift(result: FitResult, seed: int) -> np.ndarray:
    """Return the deviations of the walk from the drift."""
    truth = truth_of(applied_defect("distortion-drift", DRIFT_UM, seed), result.exposures)
    return walk_deviations(
        result, [truth[f"drift_{axis}"] for axis in "xy"], np.array([in_time(result)])
    )


def walk_of_oscillation(result: FitResult, seed: int) -> np.ndarray:
    """Return the deviations of the walk from the oscillation."""
    truth = truth_of(applied_defect("distortion-orbital", ORBITAL_UM, seed), result.exposures)
    half = 0.5 * SECONDS_PER_DAY * float(np.ptp(result.exposures["obstime"]))
    phase = 2.0 * np.pi * half / ORBITAL_PERIOD_S * in_time(result)
    waves = np.array([np.cos(phase), np.sin(phase)])
    return walk_deviations(result, [truth[f"breathing_{axis}"] for axis in "xy"], waves)


def in_time(result: FitResult) -> Float[np.ndarray, " exp"]:
    """Return the times of the exposures, from -1 for the first to 1 for the last."""
    time = result.exposures["obstime"].to_numpy()
    return 2.0 * (time - time.min()) / np.ptp(time) - 1.0


def walk_deviations(
    result: FitResult,
    coefficients: Sequence[np.ndarray | float],
    functions: Float[np.ndarray, "function exp"],
) -> np.ndarray:
    """Return the deviations of a walk, whose mean is zero, from terms times functions of the time.

    Parameters
    ----------
    coefficients : along x and along y, those of all terms for each function in turn
    """
    about_mean = functions - functions.mean(axis=1, keepdims=True)
    truth = [about_mean.T @ np.reshape(one, (len(functions), -1)) for one in coefficients]
    found = [
        deviations(result, f"drift_walk_{axis}", one.ravel())
        for axis, one in zip("xy", truth, strict=True)
    ]
    return np.concatenate(found)


def cubic_drift(result: FitResult, seed: int) -> np.ndarray:
    """Return the deviations of a cubic drift from the linear one: its other terms are zero."""
    truth = truth_of(applied_defect("distortion-drift", DRIFT_UM, seed), result.exposures)
    slopes = {group: np.atleast_1d(slope) for group, slope in truth.items()}
    found = [
        deviations(result, group, np.concatenate([slope, np.zeros(2 * len(slope))]))
        for group, slope in slopes.items()
    ]
    return np.concatenate(found)


def shifted_by_magnitude(seed: int) -> OrbitData:
    """Return an orbit whose faint stars are shifted along y of the detectors."""
    data = sparse_orbit(seed)
    rows = data.measurements
    shift = PIX_PER_MPIX * SHIFT_MPIX * faintness(rows["magnitude"].to_numpy())
    return replace(data, measurements=rows.assign(ny=rows["ny"] + shift))


def shift_of_magnitude(result: FitResult, seed: int) -> np.ndarray:
    """Return the deviations of the shifts by magnitude from the truth."""
    truth = {"magnitude_shift_x": 0.0, "magnitude_shift_y": SHIFT_MPIX}
    return np.concatenate([deviations(result, group, one) for group, one in truth.items()])


def own_terms(seed: int) -> Float[np.ndarray, "axis detector term"]:
    """Return the coefficients of the detectors' own terms, um."""
    shape = 2, len(MINI_MOCK.detectors), len(terms(OWN_DEGREE))
    return OWN_UM * np.random.default_rng(seed).standard_normal(shape)


def distorted_by_detector(seed: int) -> OrbitData:
    """Return an orbit whose detectors have a distortion each of its own."""
    data, coefficients = sparse_orbit(seed), own_terms(seed)
    rows = data.measurements.copy()
    for number, detector in enumerate(MINI_MOCK.detectors):
        on = rows["detector_id"] == detector.detector_id
        pitch = np.array([detector.pitch_x_um, detector.pitch_y_um])
        turn = np.radians(detector.rotation_deg)
        to_focal = np.array([(np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))])
        half = 0.5 * float(np.max((detector.n_x, detector.n_y) * pitch))
        at = (rows.loc[on, ["nx", "ny"]].to_numpy() * pitch) @ to_focal.T / half
        (x, y), (x0, y0) = (
            [legendre_at(one, OWN_DEGREE) for one in place.T] for place in (at, np.zeros((1, 2)))
        )
        values = [x[k] * y[j] - x0[k] * y0[j] for k, j in terms(OWN_DEGREE)]
        moved = coefficients[:, number] @ np.array(values)
        rows.loc[on, ["nx", "ny"]] += (to_focal.T @ moved).T / pitch
    return replace(data, measurements=rows)


def own_distortion(result: FitResult, seed: int) -> np.ndarray:
    """Return the deviations of the detectors' own terms from the truth."""
    found = [
        deviations(result, f"own_distortion_{axis}", one.ravel())
        for axis, one in zip("xy", own_terms(seed), strict=True)
    ]
    return np.concatenate(found)


def with_noise_floor(seed: int) -> OrbitData:
    """Return an orbit with noise by magnitude, and a floor that is not stated."""
    settings = replace(SETTINGS, seed=seed, noise_by_magnitude=True)
    data, _ = defective_orbit(settings, seed % settings.orbits)
    rows = data.measurements
    noise = FLOOR_PIX * np.random.default_rng(seed).standard_normal((2, len(rows)))
    return replace(
        data, measurements=rows.assign(nx=rows["nx"] + noise[0], ny=rows["ny"] + noise[1])
    )


def noise_floor(result: FitResult, seed: int) -> np.ndarray:
    """Return the deviation of the floor from the truth."""
    noise = result.summary["noise"]
    return np.array([(noise["floor_pix"] - FLOOR_PIX) / noise["floor_sigma_pix"]])


CASES = (
    Case(
        f"`distortion-drift={DRIFT_UM}um`",
        "--drift-walk 2",
        {"drift_walk": 2},
        drifting,
        walk_of_drift,
    ),
    Case(
        f"`distortion-drift={DRIFT_UM}um`",
        "--drift 2 --drift-in-time 3",
        {"drift": 2, "drift_in_time": 3},
        drifting,
        cubic_drift,
    ),
    Case(
        f"`distortion-orbital={ORBITAL_UM}um`",
        "--drift-walk 2",
        {"drift_walk": 2},
        oscillating,
        walk_of_oscillation,
    ),
    Case(
        f"terms of each detector, {OWN_UM} um",
        f"--detector-distortion {OWN_DEGREE}",
        {"detector_distortion": OWN_DEGREE},
        distorted_by_detector,
        own_distortion,
    ),
    Case(
        f"faint stars shifted, {SHIFT_MPIX:g} mpix at magnitude 17",
        "--magnitude-shift",
        {"magnitude_shift": True},
        shifted_by_magnitude,
        shift_of_magnitude,
        orbits=160,
    ),
    Case(
        f"a floor of {1e3 * FLOOR_PIX:g} mpix below the noise",
        "--noise-floor",
        {"noise_floor": True},
        with_noise_floor,
        noise_floor,
    ),
)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--records", type=Path, default=Path("other-models.jsonl"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
