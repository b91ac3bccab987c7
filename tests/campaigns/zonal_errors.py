"""Find how often smooth errors of the catalogue are seen in a run of 20 full orbits.

    python tests/campaigns/zonal_errors.py [--first 0] [--seeds 20] [--moved 0.1] [--folder zonal]

Each seed has a field of its own. A first run, with a field of that rms, tells by how much it moves
the mean positions. It is then scaled such that these move by `--moved`, in mas along each axis:
without their common shift, turn and scale, which pointing and focal length take up; and without all
that is linear, with the shears, which the places and pitches of the detectors take up. A stopped
campaign goes on. For two processes, give each a part of the seeds.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np
import pandas as pd
from jaxtyping import Float

from plateviz.cache import keep_compilations
from solver.model.directions import mean_direction, places_about
from solver.simulate.catalogue import truth_catalogue
from solver.simulate.settings import SurveySettings
from tests.benchmarks.machine import write
from tests.campaigns.surveys import CLEAN, ORBITS, Trial, fit, judge, moved

SETTINGS = replace(SurveySettings(orbits=ORBITS), magnitudes=True)
CAUSE = "zonal-errors"
FIRST_MAS = 0.1  # rms of the field of the first run
# What is taken from the shifts before their rms is: the number of columns of `common_motions`.
WITHOUT = {"the common shift, turn and scale": 4, "all that is linear": 6}


def main() -> int:
    arguments = parse_arguments()
    keep_compilations()
    runs: dict[str, list[Trial]] = {}
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        first = trial_of(FIRST_MAS, seed)
        for trial in (Trial(CLEAN, seed), first):
            run(trial, arguments.folder)
        for without, common in WITHOUT.items():
            ratio = arguments.moved / moved_by(first, arguments.folder, common)
            scaled = trial_of(ratio * FIRST_MAS, seed)
            run(scaled, arguments.folder)
            runs.setdefault(without, []).append(scaled)
    write(table(runs, arguments.folder))
    return 0


def trial_of(field_mas: float, seed: int) -> Trial:
    """Return the trial with a field of some rms."""
    return Trial(f"{CAUSE}={field_mas:.3f}mas", seed)


def run(trial: Trial, parent: Path) -> None:
    """Fit the survey of a trial, unless that is done."""
    folder = trial.folder(parent)
    if not (folder / "orbits.parquet").is_file():
        write(f"{trial.defect or 'clean'}, seed {trial.seed}")
        fit(trial.settings(SETTINGS), folder)


def moved_by(trial: Trial, parent: Path, common: int) -> float:
    """Return by how much a field moves mean positions: rms along one axis, mas.

    Parameters
    ----------
    common : number of the columns of `common_motions` that do not count
    """
    shift = moved(trial, parent)
    truth = truth_catalogue(trial.settings(SETTINGS)).set_index("source_id")
    at = truth.loc[shift.index, ["ra", "dec"]].to_numpy()
    columns, flat = common_motions(at)[:, :common], shift.to_numpy().T.ravel()
    left = flat - columns @ np.linalg.lstsq(columns, flat)[0] if common else flat
    return float(np.sqrt(np.mean(left**2)))


def common_motions(at: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "2n 6"]:
    """Return shifts to East and North, scale, turn and two shears, all to the East first."""
    east, north = places_about(mean_direction(*at.T), *at.T).T
    one, zero = np.ones(len(at)), np.zeros(len(at))
    parts = [(one, zero), (zero, one), (east, north), (-north, east)]
    parts += [(east, -north), (north, east)]
    return np.stack([np.concatenate(part) for part in parts], axis=1)


def table(runs: Mapping[str, Sequence[Trial]], parent: Path) -> str:
    """Return the outcome as a table of the documents.

    Parameters
    ----------
    runs : by what is taken from the shifts
    """
    lines = [
        "\n| mean positions moved by (mas) | without | field (mas) | runs | χ² | seen | named |",
        "|---:|---|---:|---:|---:|---:|---:|",
    ]
    clean = [Trial(CLEAN, trial.seed) for trial in next(iter(runs.values()))]
    for name, trials in {"(no field)": clean, **runs}.items():
        verdicts = [judge(trial, parent) for trial in trials]
        seen = sum(verdict.state != "good" for verdict in verdicts)
        named = sum(CAUSE in [cause.name for cause in verdict.causes] for verdict in verdicts)
        zonal = [pd.read_parquet(one.folder(parent) / "zonal_field.parquet") for one in trials]
        chi2 = np.mean([one["chi2"].iloc[0] for one in zonal])
        shift = [moved_by(one, parent, WITHOUT[name]) for one in trials if one.defect]
        field = [
            float(one.defect.split("=")[1].removesuffix("mas")) for one in trials if one.defect
        ]
        of_field = f"{np.mean(shift):.3f} | {name} | {np.mean(field):.2f}" if field else "- | - | 0"
        lines.append(f"| {of_field} | {len(trials)} | {chi2:.1f} | {seen} | {named} |")
    return "\n".join(lines)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--first", type=int, default=0, help="seed of the first run")
    parser.add_argument("--seeds", type=int, default=20, help="number of fields")
    parser.add_argument("--moved", type=float, default=0.1, help="of the mean positions, mas")
    parser.add_argument("--folder", type=Path, default=Path("zonal"), help="of the tables")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
