"""Time a fit from 10,000 to 3,000,000 measurements and from 24 to 384 exposures.

    python tests/benchmarks/bench_scaling.py [--measurements 10000 100000] [--exposures 24 384]
                                             [--repeat 3] [--write assets/docs]

Each size is simulated in one process and measured in another, new process, so that its peak
memory is that of the fit alone. All times are medians of warm runs. The unit is that of
`bench_fit.py`, timed for each size. `--write` writes `scaling.csv` and `scaling.svg` to the
folder, and the table into its `scaling.md`.
"""

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

from solver.fit import fit_orbit
from solver.engines.gauss_newton import find_mode
from solver.data.instrument import MINI_MOCK
from solver.io.survey import read_survey_orbit
from solver.linear.normal_equations import accumulate
from solver.problem.problem import build_problem
from solver.linear.source_elimination import eliminate_sources
from solver.data.settings import FitSettings
from solver.simulate.survey import simulate_survey
from tests.benchmarks.machine import device, machine, peak_memory_mib, time_of, write
from tests.benchmarks.orbits import (
    EXPOSURES_OF_THE_PAPER,
    MEASUREMENTS_OF_THE_PAPER,
    ORBIT,
    SOURCES_OF_THE_PAPER,
    survey_of,
)
from tests.benchmarks.scaling import Row, Scaling, write_all
from tests.benchmarks.stages import UNIT_REPEATS, fit_with_sigmas, unit_product, what_if

MEASUREMENTS = (10_000, 30_000, 100_000, MEASUREMENTS_OF_THE_PAPER, 1_000_000, 3_000_000)
EXPOSURES = (24, 48, EXPOSURES_OF_THE_PAPER, 192, 384)
OTHER_PRIOR = FitSettings(prior_widths={"detector_x": 10.0})


def main() -> None:
    arguments = parse_arguments()
    write(machine())
    rows = []
    for measurements, exposures in sizes(arguments):
        row, used = measured(measurements, exposures, arguments.repeat)
        if not rows:
            write(f"JAX on {used}\n")
            write("".join(f"{name:>14}" for name in Row._fields))
        write("".join(f"{value:14.4g}" if value < 1000 else f"{value:14.0f}" for value in row))
        rows.append(row)
    if arguments.write is not None:
        write_all(Scaling(rows, f"{machine()}, JAX on {used}"), arguments.write)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time fits of many sizes.")
    parser.add_argument(
        "--measurements",
        type=int,
        nargs="*",
        default=MEASUREMENTS,
        help=f"approximate numbers of measurements, on {EXPOSURES_OF_THE_PAPER} exposures",
    )
    parser.add_argument(
        "--exposures",
        type=int,
        nargs="*",
        default=EXPOSURES,
        help="numbers of exposures, of the paper's stars",
    )
    parser.add_argument(
        "--repeat", type=int, default=3, help="runs of each stage; medians are reported"
    )
    parser.add_argument("--write", type=Path, help="folder for the table and the plot")
    return parser.parse_args()


def sizes(arguments: argparse.Namespace) -> Iterator[tuple[int, int]]:
    """Yield the number of measurements, for 96 exposures, and the number of exposures."""
    along_both = [(count, EXPOSURES_OF_THE_PAPER) for count in arguments.measurements]
    along_both += [(MEASUREMENTS_OF_THE_PAPER, count) for count in arguments.exposures]
    yield from dict.fromkeys(along_both)


def measured(measurements: int, exposures: int, repeat: int) -> tuple[Row, str]:
    """Simulate and measure one size, each in its own process."""
    sources = measurements / MEASUREMENTS_OF_THE_PAPER * SOURCES_OF_THE_PAPER
    survey = survey_of(sources, exposures)
    pool = ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1)
    with TemporaryDirectory() as folder, pool:
        directory = Path(folder) / "survey"
        pool.submit(simulate_survey, directory, survey).result()
        return pool.submit(measure, directory, survey.n_stars, repeat).result()


def measure(directory: Path, stars: int, repeat: int) -> tuple[Row, str]:
    data, settings = read_survey_orbit(directory, ORBIT), FitSettings()
    # Warm up: compile everything and touch the memory.
    if not fit_orbit(data, MINI_MOCK, settings).summary["converged"]:
        sys.exit(f"the fit of {len(data.measurements)} measurements did not converge")
    # Measured before the other stages, which keep several solutions at once.
    peak = peak_memory_mib()
    problem = build_problem(data, MINI_MOCK, settings)
    mode = find_mode(problem, settings)
    seconds = {
        "unit": time_of(unit_product(problem), UNIT_REPEATS),
        "prepare": time_of(lambda: build_problem(data, MINI_MOCK, settings), repeat),
        "linearise": time_of(lambda: accumulate(problem, mode.theta, mode.sources), repeat),
        "reduce": time_of(lambda: eliminate_sources(mode.equations, problem.priors), repeat),
        "fit": time_of(lambda: fit_with_sigmas(problem, settings), repeat),
        "what_if": time_of(what_if(data, settings, OTHER_PRIOR), repeat),
        "tables": time_of(lambda: fit_orbit(data, MINI_MOCK, settings), repeat),
    }
    row = Row(
        stars,
        problem.n_obs,
        problem.n_src,
        len(problem.exposures),
        problem.layout.size,
        iterations=len(mode.trace) - 1,
        **seconds,
        memory=peak,
    )
    return row, device()


if __name__ == "__main__":
    main()
