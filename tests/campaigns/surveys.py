"""Find how often a run of 20 orbits is called flawed: without defects, and with each of them.

    python tests/campaigns/surveys.py [--clean 20] [--repeats 2] [--folder FOLDER] [--only NAME ...]

Each trial simulates a survey of sparse orbits, of some 1,100 sources each, fits it with the default
settings, and keeps the small tables from which the run is judged. The runs are then judged anew
from these tables, so that a change of the verdict takes no fit. A stopped campaign goes on. Beside
each defect stands by how much it moves the mean positions, against a run with the same noise
without it.
"""

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np
import pandas as pd

from plateviz.cache import keep_compilations
from plateviz.runs.dask_workers import fit_survey_orbit
from plateviz.runs.fit_survey import gather
from plateviz.runs.new_run import begin_run
from plateviz.runs.run import Run
from plateviz.runs.run_tables import read_run_tests
from plateviz.tables.run_diagnosis import RunTests
from plateviz.verdict.run_verdict import run_verdict
from plateviz.verdict.verdict import Verdict
from solver.data.run_schema import RUN_TABLES
from solver.data.settings import FitSettings
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.benchmarks.machine import write

ORBITS = 20
SETTINGS = replace(SurveySettings(orbits=ORBITS).scaled(20_000), magnitudes=True)
CLEAN = ""
FIRST_SEED = 1000  # of the runs with a defect
MANY_ORBITS = 10  # of sources whose mean positions are compared
# Names of the causes that are the right ones for a defect.
RIGHT = {
    "zonal-errors=0.1mas": ("zonal-errors",),
    "zonal-errors=0.3mas": ("zonal-errors",),
    "zonal-errors=0.5mas": ("zonal-errors",),
    "zonal-errors=1mas": ("zonal-errors",),
    "distortion-trend=30nm": ("calibration-trend",),
    "distortion-trend=100nm": ("calibration-trend",),
    "focal-trend=3000ppm": ("calibration-trend",),
    "focal-trend=6000ppm": ("calibration-trend",),
    "distortion-drift=30nm": ("distortion-drifts", "weak-in-each-orbit"),
    "distortion-orbital=30nm": ("distortion-oscillates", "weak-in-each-orbit"),
    "distortion-step=30nm": ("distortion-steps", "weak-in-each-orbit"),
    "distortion-order=30nm": ("order", "weak-in-each-orbit"),
    "focal-anisotropy=2ppm": ("anisotropy", "weak-in-each-orbit"),
    "pointing-jitter=4mas": ("jitter",),
    "detector-shift=50nm": ("detector-shifts", "weak-in-each-orbit"),
    "detector-turn=1arcsec": ("detector-turns", "weak-in-each-orbit"),
    "charge-transfer=5mpix": ("charge-transfer-y", "weak-in-each-orbit"),
    "pixel-phase=2mpix": ("pixel-phase-x", "pixel-phase-y", "weak-in-each-orbit"),
    "noise=3%": ("noise", "weak-in-each-orbit"),
    "noise-exposure=10%": ("noise-of-exposures", "weak-in-each-orbit"),
    "noise-magnitude=10%": ("noise-of-magnitudes", "weak-in-each-orbit"),
    "outliers=0.1%": ("outliers",),
    "swapped=0.2%": ("swapped",),
    "satellite-velocity=7.6km/s": ("velocity", "weak-in-each-orbit"),
    "reference-errors=50%": ("reference-errors", "wrong-references"),
    "binaries=5": ("wrong-references", "reference-scatters"),
    "exposure-times=10h": ("wrong-references", "reference-errors"),
}


class Trial(NamedTuple):
    """A survey: its defect as text, empty for none, and its seed."""

    defect: str
    seed: int

    def settings(self, of_all: SurveySettings) -> SurveySettings:
        """Return the settings of its survey, given those that all have."""
        return replace(of_all, seed=self.seed, defects=(self.defect,) if self.defect else ())

    def folder(self, parent: Path) -> Path:
        """Return where its tables are kept."""
        return parent / f"{(self.defect or 'clean').replace('/', ' per ')} {self.seed}"


def main() -> int:
    arguments = parse_arguments()
    names = arguments.only or list(RIGHT)
    trials = [Trial(CLEAN, seed) for seed in range(arguments.clean)]
    seeds = range(FIRST_SEED, FIRST_SEED + arguments.repeats)
    trials += [Trial(name, seed) for seed in seeds for name in (CLEAN, *names)]
    keep_compilations()
    for trial in trials:
        folder = trial.folder(arguments.folder)
        if not (folder / "orbits.parquet").is_file():
            write(f"{trial.defect or 'clean'}, seed {trial.seed}")
            fit(trial.settings(SETTINGS), folder)
    write(table(trials, arguments.folder))
    return 0


def fit(settings: SurveySettings, folder: Path) -> None:
    """Simulate and fit a survey, and keep the tables from which the run is judged."""
    with tempfile.TemporaryDirectory() as scratch:
        survey = Path(scratch) / "survey"
        simulate_survey(survey, settings)
        run = begin_run(survey, "default", FitSettings())
        for orbit in range(settings.orbits):
            fit_survey_orbit(str(survey), run.name, orbit)
        gather(run)
        found = Run(run)
        folder.mkdir(parents=True, exist_ok=True)
        tests = read_run_tests(found)
        frames = (tests.calibrations, tests.orbit_tests, tests.orbit_causes, tests.zonal)
        for table_, frame in zip(RUN_TABLES, frames, strict=True):
            frame.to_parquet(folder / f"{table_.name}.parquet")
        found.motions().to_parquet(folder / "motions.parquet")
        # The last one: a folder that has it is whole.
        found.orbits().to_parquet(folder / "orbits.parquet")


def judge(trial: Trial, parent: Path) -> Verdict:
    """Return the verdict on a run from its kept tables."""
    folder = trial.folder(parent)
    tables = [pd.read_parquet(folder / f"{table_.name}.parquet") for table_ in RUN_TABLES]
    orbits, motions = (pd.read_parquet(folder / f"{n}.parquet") for n in ("orbits", "motions"))
    return run_verdict(orbits, motions, RunTests(*tables))


def table(trials: Sequence[Trial], folder: Path) -> str:
    """Return the outcome of all trials as a table of the documents."""
    lines = [
        "\n| defect | moves mean positions by (mas) | runs | seen | named |"
        " should not be trusted | causes named first |",
        "|---|---:|---:|---:|---:|---:|---|",
    ]
    for defect in dict.fromkeys(trial.defect for trial in trials):
        of_defect = [trial for trial in trials if trial.defect == defect]
        verdicts = [judge(trial, folder) for trial in of_defect]
        seen = sum(verdict.state != "good" for verdict in verdicts)
        bad = sum(verdict.state == "bad" for verdict in verdicts)
        names = [[cause.name for cause in verdict.causes] for verdict in verdicts]
        right = sum(bool(set(RIGHT.get(defect, ())) & set(one)) for one in names)
        # Without a solution there is no cause, only a fault: that there is none.
        first = Counter(
            (*one, "no solution" if verdict.faults else "-")[0]
            for one, verdict in zip(names, verdicts, strict=True)
        )
        text = ", ".join(f"{name} {count}" for name, count in first.most_common())
        label = f"`{defect}`" if defect else "none"
        shifts = [shift(trial, folder) for trial in of_defect] if defect else []
        known = [one for one in shifts if np.isfinite(one)]
        lines.append(
            f"| {label} | {f'{np.mean(known):.2g}' if known else '-'} | {len(verdicts)} | {seen} |"
            f" {right if defect else '-'} | {bad} | {text} |"
        )
    return "\n".join(lines)


def shift(trial: Trial, parent: Path) -> float:
    """Return by how much a defect moves mean positions: rms in one coordinate, mas.

    Compared are the sources with many orbits that are no reference stars; NaN if there are none.
    """
    found = moved(trial, parent).to_numpy()
    return float(np.sqrt(np.mean(found**2))) if len(found) else float("nan")


def moved(trial: Trial, parent: Path) -> pd.DataFrame:
    """Return by how much a defect moves the mean positions of these sources, mas."""
    columns = ["mean_deviation_ra", "mean_deviation_dec"]
    with_it, without = (motions(one, parent) for one in (trial, Trial(CLEAN, trial.seed)))
    both = often_measured(without).intersection(with_it.index)
    return with_it.loc[both, columns] - without.loc[both, columns]


def motions(trial: Trial, parent: Path) -> pd.DataFrame:
    """Return the kept motions of a run by source."""
    return pd.read_parquet(trial.folder(parent) / "motions.parquet").set_index("source_id")


def often_measured(found: pd.DataFrame) -> pd.Index:
    """Return the sources with many orbits that are no reference stars."""
    return found.index[(found["n_orbits"] >= MANY_ORBITS) & ~found["is_reference"]]


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--clean", type=int, default=20, help="runs without a defect")
    parser.add_argument("--repeats", type=int, default=2, help="runs of each defect")
    parser.add_argument("--only", nargs="*", help="defects as NAME=AMPLITUDE; all by default")
    parser.add_argument("--folder", type=Path, default=Path("surveys"), help="of the tables")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
