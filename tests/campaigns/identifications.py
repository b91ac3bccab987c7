"""Find how many swapped identifications a robust fit lists, and what they do to the positions.

    python tests/campaigns/identifications.py [--orbits 10] [--full N] [--records FILE]

Each orbit is simulated without and with swapped identifications, with the same noise, and fitted
with the search for outliers (`--robust`); a sparse orbit has some 1,300 sources, a full one 6,500.
Trials are recorded; a stopped campaign goes on.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np
import pandas as pd

from plateviz.cache import keep_compilations
from plateviz.tables.outliers import EXCHANGED, outlier_list
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import FitError, InputError
from solver.fit import fit_orbit
from solver.simulate.settings import SurveySettings
from solver.units import MAS_PER_DEG
from tests.benchmarks.machine import write
from tests.benchmarks.orbits import ORBIT, SOURCES_OF_THE_PAPER, survey_of
from tests.campaigns.defects import SETTINGS, defective_orbit, pulls, rms
from tests.campaigns.trials import Record, run_trials

PERCENT = (0.2, 1.0)
# A measurement that is moved by less, in sigmas, looks as if it were good.
VISIBLE = 6.0
# The number of a trial is the seed of the orbit, and tells its size and amplitude as well.
_PER_AMPLITUDE = 1_000
_FIRST_FULL = 100_000
_KEY = ["field_id", "plate_id", "detector_id", "source_id"]
_ROBUST = FitSettings(robust=True)


def main() -> int:
    arguments = parse_arguments()
    keep_compilations()
    sizes = {"sparse": (0, arguments.orbits), "full": (_FIRST_FULL, arguments.full)}
    for first, orbits in sizes.values():
        # Both amplitudes of an orbit one after the other: they are compared with the same fit.
        numbers = [
            first + _PER_AMPLITUDE * amplitude + seed
            for seed in range(orbits)
            for amplitude in range(len(PERCENT))
        ]
        run_trials(arguments.records, numbers, trial, after=report)
    write(
        "\n| orbits | swapped | converged | swapped measurements | moved by less than 6 σ "
        "| listed | listed of those moved by more | with the right source "
        "| good measurements listed | rms pull of the other sources, without the defect "
        "| of all sources, without the defect | rms shift of the others, σ |"
    )
    write(f"|---|{'---:|' * 11}")
    for size, (first, orbits) in sizes.items():
        for amplitude, percent in enumerate(PERCENT if orbits else ()):
            start = first + _PER_AMPLITUDE * amplitude
            records = run_trials(arguments.records, range(start, start + orbits), trial)
            write(row(f"{orbits} {size}", percent, records))
    return 0


def trial(number: int) -> Record:
    """Return what a robust fit lists of the swapped measurements of an orbit, and its pulls."""
    of_size, seed = number % _FIRST_FULL, number % _PER_AMPLITUDE
    percent = PERCENT[of_size // _PER_AMPLITUDE]
    is_full, start = number >= _FIRST_FULL, time.process_time()
    try:
        found = scores(seed, is_full, percent)
    except (FitError, InputError) as error:
        return {"failed": str(error)}
    return {**found, "seconds": round(time.process_time() - start, 1)}


def scores(seed: int, is_full: bool, percent: float) -> Record:
    """Return the scores of a robust fit of an orbit with swapped identifications."""
    settings, orbit_id = simulated(seed, is_full)
    defect = f"swapped={percent}%"
    data, affected = defective_orbit(replace(settings, defects=(defect,)), orbit_id)
    clean, without = fit_without(seed, is_full)
    return compared(fit_orbit(data, settings=_ROBUST), data, affected, without, clean)


def simulated(seed: int, is_full: bool) -> tuple[SurveySettings, int]:
    """Return the survey of an orbit, and the number of the orbit in it."""
    if is_full:
        return replace(survey_of(SOURCES_OF_THE_PAPER), seed=seed), ORBIT
    return replace(SETTINGS, seed=seed), seed % SETTINGS.orbits


@lru_cache(maxsize=1)
def fit_without(seed: int, is_full: bool) -> tuple[OrbitData, FitResult]:
    """Return an orbit without the defect, and its robust fit."""
    settings, orbit_id = simulated(seed, is_full)
    data, _ = defective_orbit(settings, orbit_id)
    return data, fit_orbit(data, settings=_ROBUST)


def compared(
    result: FitResult,
    data: OrbitData,
    affected: pd.DataFrame,
    without: FitResult,
    clean: OrbitData,
) -> dict[str, float | int | bool]:
    """Return how the outliers of a fit compare with the swapped measurements, and its pulls.

    Parameters
    ----------
    result, data : robust fit, and the orbit with swapped identifications
    affected : `defect_schema.AFFECTED` of the orbit
    without, clean : robust fit, and the orbit without the defect
    """
    swapped, measured = keys(affected), keys(data.measurements)
    moved = sigmas_moved(data.measurements, clean.measurements, swapped)
    listed = swapped.isin(keys(result.outliers))
    is_good = ~measured.isin(swapped)
    partner = pd.Series(outlier_list(result)[EXCHANGED].to_numpy(), keys(result.outliers))
    true_source = affected["true_source_id"].astype(str).to_numpy()
    spoilt = affected["source_id"].unique()
    others, others_without = (
        one.sources[~one.sources["source_id"].isin(spoilt)] for one in (result, without)
    )
    places = result.true_places
    return {
        "converged": bool(result.summary["converged"]),
        "swapped": len(swapped),
        "hidden": int((moved <= VISIBLE).sum()),
        "listed": int(listed.sum()),
        "visible_listed": int((listed & (moved > VISIBLE)).sum()),
        "partner": int((partner.reindex(swapped).to_numpy() == true_source).sum()),
        "good": int(is_good.sum()),
        "good_listed": int(measured[is_good].isin(keys(result.outliers)).sum()),
        "others": len(others),
        "pull_others": rms(pulls(others, places)),
        "pull_others_without": rms(pulls(others_without, places)),
        "pull_all": rms(pulls(result.sources, places)),
        "pull_all_without": rms(pulls(without.sources, places)),
        "shift_others": rms(shifts(others, others_without)),
    }


def keys(table: pd.DataFrame) -> pd.MultiIndex:
    """Return the exposure, detector and source of each measurement of an orbit."""
    return pd.MultiIndex.from_frame(table[_KEY])


def sigmas_moved(
    measurements: pd.DataFrame, without: pd.DataFrame, chosen: pd.MultiIndex
) -> np.ndarray:
    """Return by how many sigmas a defect moves the chosen measurements, shape (n,)."""
    after, before = (
        table.set_index(_KEY)[["nx", "ny", "sx", "sy"]].reindex(chosen)
        for table in (measurements, without)
    )
    moved = (after[["nx", "ny"]] - before[["nx", "ny"]]).to_numpy()
    return np.hypot(*(moved / before[["sx", "sy"]].to_numpy()).T)


def shifts(sources: pd.DataFrame, without: pd.DataFrame) -> np.ndarray:
    """Return the differences of two solutions of the same sources in marginal sigmas, (n, 2)."""
    both = sources.merge(without, on="source_id", suffixes=("", "_without"))
    stretch = np.cos(np.radians(both["dec"]))
    ra = MAS_PER_DEG * (both["ra"] - both["ra_without"]) * stretch / both["sigma_ra_marginal"]
    dec = MAS_PER_DEG * (both["dec"] - both["dec_without"]) / both["sigma_dec_marginal"]
    return np.stack([ra, dec], axis=1)


def report(number: int, record: Record) -> None:
    """Print one line about a trial."""
    size = "full" if number >= _FIRST_FULL else "sparse"
    percent = PERCENT[number % _FIRST_FULL // _PER_AMPLITUDE]
    write(f"{size} orbit {number % _PER_AMPLITUDE}, {percent} % swapped: {record}")


def row(orbits: str, percent: float, records: Sequence[Record]) -> str:
    """Return the line of the table for the orbits of one size with one amplitude."""
    done = [record for record in records if "failed" not in record]
    converged = f"{sum(one['converged'] for one in done)} of {len(records)}"
    if not done:
        return f"| {orbits} | {percent} % | {converged} |{' - |' * 9}"
    total = {name: sum(one[name] for one in done) for name in done[0]}
    visible = total["swapped"] - total["hidden"]
    cells = [
        f"{total['swapped']:,}",
        f"{total['hidden']:,}",
        share(total["listed"], total["swapped"]),
        share(total["visible_listed"], visible),
        share(total["partner"], total["swapped"]),
        f"{total['good_listed']:,} of {total['good']:,}",
        f"{mean(done, 'pull_others'):.3f}, {mean(done, 'pull_others_without'):.3f}",
        f"{mean(done, 'pull_all'):.3f}, {mean(done, 'pull_all_without'):.3f}",
        f"{mean(done, 'shift_others'):.3f}",
    ]
    return f"| {orbits} | {percent} % | {converged} | {' | '.join(cells)} |"


def share(part: int, whole: int) -> str:
    """Return a share in per cent, rounded down so that only all are 100 %."""
    return f"{np.floor(1000.0 * part / whole) / 10.0:g} %" if whole else "none"


def mean(records: Sequence[Record], name: str) -> float:
    """Return the root of the mean square over orbits."""
    return float(np.sqrt(np.mean([one[name] ** 2 for one in records])))


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--orbits", type=int, default=10, help="sparse orbits per amplitude")
    parser.add_argument("--full", type=int, default=0, help="full orbits per amplitude")
    parser.add_argument("--records", type=Path, default=Path("identifications.jsonl"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
