"""Find the amplitude at which each defect makes the pulls of the positions 1.1.

    python tests/campaigns/defects.py [--orbits 3] [--records FILE] [--defects NAME ...]

Each orbit is simulated without and with the defect, with the same noise, and fitted with the
default settings; it has some 1,500 sources. The figure is the rms pull of the non-reference sources
with 20 measurements or more. What the defect adds to its square, which noise alone makes one, is
taken from the pair, so that the noise of a single orbit hardly enters. Trials are recorded; a
stopped campaign goes on.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np
import pandas as pd

from solver.data.orbit import OrbitData
from solver.errors import FitError, InputError
from solver.fit import fit_orbit
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.defects.defect import AppliedDefect, Defect
from solver.simulate.defects.stages import defective_catalogue
from solver.simulate.defects.table import BY_NAME, DEFECTS
from solver.simulate.defects.text import format_defect, parse_defects
from solver.simulate.measure import measure_orbit
from solver.simulate.settings import SurveySettings
from solver.units import MAS_PER_DEG
from tests.benchmarks.machine import write
from tests.campaigns.trials import Record, run_trials

FULL_SETTINGS = SurveySettings(orbits=100, magnitudes=True)
# A sparse orbit has a twentieth of the survey's stars.
SETTINGS = replace(SurveySettings(orbits=100).scaled(28_000), magnitudes=True)
MIN_MEASUREMENTS = 20
# A pull of 1.1 less what noise makes.
WANTED = 1.1**2 - 1.0
# Amplitudes within this share of the wanted effect are found, in so many fits at most.
TOLERANCE, MOST_FITS = 0.1, 5
# The seed is the orbit, and the number of a trial tells the defect as well.
_PER_DEFECT = 10_000


def main() -> int:
    arguments = parse_arguments()
    names = arguments.defects or list(BY_NAME)
    for orbit in range(arguments.orbits):
        numbers = [_PER_DEFECT * list(BY_NAME).index(name) + orbit for name in names]
        run_trials(arguments.records, numbers, trial, after=report)
    write("\n| defect | amplitude for pulls of 1.1 | orbits |\n|---|---:|---|")
    for name in names:
        first = _PER_DEFECT * list(BY_NAME).index(name)
        numbers = range(first, first + arguments.orbits)
        write(row(BY_NAME[name], run_trials(arguments.records, numbers, trial)))
    return 0


def trial(number: int) -> Record:
    """Return the amplitude at which a defect has the wanted effect in an orbit, and each fit."""
    defect, seed = DEFECTS[number // _PER_DEFECT], number % _PER_DEFECT
    amplitude = parse_defects([f"{defect.name}={defect.example}"])[defect.name]
    without, fits = mean_square(seed, ()), []
    for _ in range(MOST_FITS):
        try:
            effect = mean_square(seed, (format_defect(defect.name, amplitude),)) - without
        except (FitError, InputError) as error:
            fits.append([amplitude, str(error)])
            break
        fits.append([amplitude, effect])
        if abs(effect / WANTED - 1.0) < TOLERANCE or amplitude in (defect.low, defect.high):
            break
        amplitude = next_amplitude(defect, fits)
        if amplitude == fits[-1][0]:
            break
    return {"fits": fits}


def next_amplitude(defect: Defect, fits: Sequence[Sequence]) -> float:
    """Return where the effect is as wanted, a power of the amplitude, by the last two fits."""
    (amplitude, effect), power = fits[-1], 2.0
    if len(fits) > 1 and min(effect, fits[-2][1]) > 0.0 and effect != fits[-2][1]:
        power = np.log(effect / fits[-2][1]) / np.log(amplitude / fits[-2][0])
    factor = (WANTED / max(effect, 1e-4)) ** (1.0 / np.clip(power, 0.5, 3.0))
    following = float(np.clip(amplitude * np.clip(factor, 0.02, 30.0), defect.low, defect.high))
    return max(round(following), 1) if defect.is_count else following


@cache
def mean_square(seed: int, defects: tuple[str, ...]) -> float:
    """Return the mean squared pull of the non-reference sources with many measurements.

    Raises
    ------
    FitError
        If the fit has no solution.
    """
    result = fit_orbit(sparse_orbit(seed, defects))
    if not result.summary["converged"]:
        raise FitError(f"no solution: {result.summary['reason']}")
    return float(np.mean(pulls(result.sources, result.true_places) ** 2))


def sparse_orbit(seed: int, defects: tuple[str, ...] = ()) -> OrbitData:
    """Return the orbit of a survey whose number is the last two digits of the seed."""
    settings = replace(SETTINGS, seed=seed, defects=defects)
    return defective_orbit(settings, seed % settings.orbits)[0]


def full_orbit(seed: int, defects: tuple[str, ...] = ()) -> OrbitData:
    """Return such an orbit of the paper's survey, with twenty times the stars."""
    settings = replace(FULL_SETTINGS, seed=seed, defects=defects)
    return defective_orbit(settings, seed % settings.orbits)[0]


def defective_orbit(settings: SurveySettings, orbit_id: int) -> tuple[OrbitData, pd.DataFrame]:
    """Return an orbit of a survey, and `AFFECTED` of its measurements."""
    truth = truth_catalogue(settings)
    catalogue, _ = defective_catalogue(reference_catalogue(truth, settings), truth, settings)
    orbit = measure_orbit(orbit_id, truth, settings)
    measured = truth["source_id"].isin(orbit.measurements["source_id"])
    tables = (table[measured].reset_index(drop=True) for table in (catalogue, truth))
    return OrbitData(orbit.measurements, orbit.exposures, *tables), orbit.affected


def pulls(sources: pd.DataFrame, true_places: pd.DataFrame | None) -> np.ndarray:
    """Return the pulls in ra and dec, shape (n, 2)."""
    if true_places is None:
        raise InputError("expected a truth, found none")
    rows = sources.merge(true_places, on="source_id", suffixes=("", "_true"))
    rows = rows[~rows["is_reference"] & (rows["n_obs"] >= MIN_MEASUREMENTS)]
    stretch = np.cos(np.radians(rows["dec"]))
    ra = MAS_PER_DEG * (rows["ra"] - rows["ra_true"]) * stretch / rows["sigma_ra_marginal"]
    dec = MAS_PER_DEG * (rows["dec"] - rows["dec_true"]) / rows["sigma_dec_marginal"]
    return np.stack([ra, dec], axis=1)


def rms(values: np.ndarray) -> float:
    """Return the root of the mean square, as it is recorded."""
    return round(float(np.sqrt(np.mean(np.square(values)))), 4)


def applied_defect(name: str, amplitude: float, seed: int) -> AppliedDefect:
    """Return a defect of such an orbit, with the amplitude in the unit of its table."""
    return AppliedDefect(name, amplitude, replace(SETTINGS, seed=seed), seed % SETTINGS.orbits)


def report(number: int, record: Record) -> None:
    """Print one line about a trial."""
    steps = ", ".join(describe(DEFECTS[number // _PER_DEFECT], *one) for one in record["fits"])
    write(f"{number}, {DEFECTS[number // _PER_DEFECT].name}: {steps}")


def row(defect: Defect, records: Sequence[Record]) -> str:
    """Return the line of the table for a defect."""
    found = [record["fits"][-1] for record in records]
    good = [amplitude for amplitude, effect in found if is_found(effect)]
    others = {describe(defect, *one) for one in found if not is_found(one[1])}
    median = f"{np.median(good):.2g} {defect.unit}".rstrip() if good else "-"
    remarks = "; ".join([f"{len(good)} of {len(found)}", *sorted(others)])
    return f"| `{defect.name}` | {median} | {remarks} |"


def is_found(effect: float | str) -> bool:
    """Return whether an effect is as wanted."""
    return not isinstance(effect, str) and abs(effect / WANTED - 1.0) < 2.0 * TOLERANCE


def describe(defect: Defect, amplitude: float, effect: float | str) -> str:
    """Return the outcome of a fit in words."""
    at = f"at {amplitude:.3g} {defect.unit}".rstrip()
    if isinstance(effect, str):
        return f"{at} {effect}"
    return f"{at} pulls {np.sqrt(max(1.0 + effect, 0.0)):.2f}"


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--orbits", type=int, default=3, help="orbits per defect")
    parser.add_argument("--defects", nargs="*", choices=list(BY_NAME), help="all by default")
    parser.add_argument("--records", type=Path, default=Path("defects.jsonl"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
