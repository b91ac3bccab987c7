"""Time a survey: its simulation, runs with one and two workers, and a killed and resumed run.

    python tests/benchmarks/bench_survey.py [--orbits 8] [--stars 132651] [--kills 0] [--keep DIR]

The unit is that of `bench_fit.py`, for the survey's first orbit. With `--kills N` a further run
is killed N times at random moments (SIGKILL to all its processes), resumed each time, and then
compared byte for byte with the uninterrupted run.
"""

import argparse
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

from plateviz.runs.run import Run
from plateviz.runs.run_directory import RunDirectory
from solver.data.instrument import MINI_MOCK
from solver.io.survey import read_survey_orbit
from solver.problem.problem import build_problem
from solver.data.settings import FitSettings
from tests.benchmarks.machine import machine, time_of, write
from tests.benchmarks.stages import UNIT_REPEATS, unit_product

_MIB_PER_KIB = 1.0 / 1024.0
ORBITS_OF_THE_PAPER = 100


def main() -> None:
    arguments = parse_arguments()
    with TemporaryDirectory(prefix="plateviz-") as scratch:
        survey = Path(arguments.keep or scratch) / "survey"
        write(machine())
        simulating = seconds_of(
            "simulate", survey, "--orbits", arguments.orbits, "--stars", arguments.stars
        )
        problem = build_problem(read_survey_orbit(survey, 0), MINI_MOCK, FitSettings())
        unit = time_of(unit_product(problem), UNIT_REPEATS)
        write(
            f"{arguments.orbits} orbits of {problem.n_obs} measurements, {problem.n_src} sources; "
            f"unit {unit:.4f} s\n"
        )
        seconds = {"simulate": simulating}
        for workers in (1, 2):
            seconds[f"survey, workers {workers}"] = seconds_of(
                "survey", survey, "--run", f"by-{workers}", "--workers", workers
            )
        report(seconds, arguments.orbits, unit)
        one, two = (RunDirectory(survey, f"by-{workers}") for workers in (1, 2))
        write(f"\ntwo workers compared with one: {ratio(seconds):.2f} times as fast")
        write(f"identical files from both: {contents(one) == contents(two)}")
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * _MIB_PER_KIB
        write(f"peak memory of one process: {peak:.0f} MiB")
        disk = sum(path.stat().st_size for path in two.directory.rglob("*") if path.is_file())
        write(f"disk: {disk / arguments.orbits / 2**20:.1f} MiB for each orbit")
        time_queries(Run(two))
        if arguments.kills:
            is_same = survives_kills(survey, two, arguments)
            write(f"identical files after {arguments.kills} kills: {is_same}")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time a survey.")
    parser.add_argument("--orbits", type=int, default=8)
    parser.add_argument("--stars", type=int, default=132_651)
    parser.add_argument("--kills", type=int, default=0, help="number of times that a run is killed")
    parser.add_argument("--keep", help="folder to keep the survey in")
    return parser.parse_args()


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "plateviz.cli.main", *map(str, arguments)]


def seconds_of(*arguments: object) -> float:
    """Return the wall time of a plateviz command, including imports and compilations."""
    start = time.perf_counter()
    subprocess.run(command(*arguments), check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def ratio(seconds: dict[str, float]) -> float:
    return seconds["survey, workers 1"] / seconds["survey, workers 2"]


def report(seconds: dict[str, float], orbits: int, unit: float) -> None:
    write(f"{'stage':<24}{'seconds':>9}{'per orbit':>11}{'units':>8}{'of 100':>10}")
    for name, value in seconds.items():
        each = value / orbits
        whole = each * ORBITS_OF_THE_PAPER / 60.0
        write(f"{name:<24}{value:9.1f}{each:11.2f}{each / unit:8.1f}{whole:6.1f} min")


def contents(run: RunDirectory) -> dict[str, bytes]:
    """Return the bytes of every file of a run, except the file of timings."""
    return {
        str(path.relative_to(run.directory)): path.read_bytes()
        for path in sorted(run.directory.rglob("*"))
        if path.is_file() and path.name != "timings.json"
    }


def time_queries(run: Run) -> None:
    """Time the queries of a run with warm caches."""
    counts = run.counts()
    most_frequent = int(counts.loc[counts["n_orbits"].idxmax(), "source_id"])
    for name, query in {
        "history of one source": lambda: run.history(most_frequent),
        "counts of all sources": run.counts,
        "orbits with their health": run.orbits,
    }.items():
        write(f"{name}: {1e3 * time_of(query, 5):.0f} ms")


def survives_kills(
    survey: Path, uninterrupted: RunDirectory, arguments: argparse.Namespace
) -> bool:
    """Return whether a run that is killed repeatedly writes the same files as another run."""
    rng, run = random.Random(0), RunDirectory(survey, "killed")
    finished: set[int] = set()
    for kill in range(arguments.kills):
        arguments_of_run = command("survey", survey, "--run", run.name)
        process = subprocess.Popen(
            arguments_of_run, stdout=subprocess.DEVNULL, start_new_session=True
        )
        time.sleep(rng.uniform(1.0, 25.0))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        complete = set(run.complete_orbits())
        write(f"kill {kill + 1}: {len(complete)} orbits complete")
        if not finished <= complete:
            return False
        finished = complete
    seconds_of("survey", survey, "--run", run.name)
    return contents(run) == contents(uninterrupted)


if __name__ == "__main__":
    main()
