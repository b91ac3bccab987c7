"""Time what the solver process does for a what-if of a full-size orbit, in stages.

    python tests/benchmarks/bench_what_if.py [--sources 7000] [--repeat 7]

For each kind of change it prints the median milliseconds of each stage, of all of it until a page
has the figures, and of the verdict, which follows. It also prints all of it in units of one matrix
product that is timed in the same run, so that results of different machines can be compared.
`bench_fit.py` describes the unit; `bench_browser.py` times the same from a person's hand to the
screen.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np

from plateviz.runs.scratch_result import write_scratch_result, write_verdict
from plateviz.verdict.verdict import with_verdict
from solver.data.subset import Subset
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.fit import OrbitFitter
from solver.linear.covariances import covariances
from solver.linear.leverage import residuals
from solver.runtime.memory import keep_memory
from solver.runtime.threads import one_blas_thread
from tests.benchmarks.machine import machine, time_of, write
from tests.benchmarks.orbits import simulated_orbit, survey_of
from tests.benchmarks.stages import UNIT_REPEATS, unit_product

# Sources in a corner of a residual map.
_CORNER = 40


def main() -> None:
    arguments = parse_arguments()
    # As the program does.
    keep_memory()
    data = simulated_orbit(survey_of(arguments.sources))
    fitter = OrbitFitter(data)
    fitter.fit(FitSettings(order=6))
    for _ in fitter.precompute(6):
        pass
    units, rows = [], {}
    with TemporaryDirectory() as folder:
        for name, settings in changes(data).items():
            found = fitter.partial_what_if(settings(0))
            if found is None:
                sys.exit(f"no what-if for {settings(0)}")
            product = unit_product(found.solution.problem)
            units.append(time_of(product, UNIT_REPEATS))
            runs = [
                stages(fitter, settings(number), Path(folder) / f"{name}-{number}")
                for number in range(1, arguments.repeat + 1)
            ]
            rows[name] = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
    unit = statistics.median(units)
    write(machine())
    write(f"{len(data.measurements)} measurements; unit: {1e3 * unit:.1f} ms\n")
    write(f"{'what-if, ms':<28}" + "".join(f"{stage:>12}" for stage in [*rows[name], "units"]))
    for name, times in rows.items():
        cells = "".join(f"{1e3 * seconds:12.0f}" for seconds in times.values())
        write(f"{name:<28}{cells}{times['all'] / unit:12.1f}")


def changes(data: OrbitData) -> dict[str, Callable[[int], FitSettings]]:
    """Return by name the settings of what-ifs; each number gives others."""
    ids = np.unique(data.measurements["source_id"])

    def corner(number: int) -> FitSettings:
        members = np.random.default_rng(number).choice(ids, _CORNER + number, replace=False)
        return FitSettings(
            order=6, exclusions=Subset(sources=frozenset(map(int, members.tolist())))
        )

    def widths(name: str, first: float, order: int = 6) -> Callable[[int], FitSettings]:
        return lambda number: FitSettings(
            order=order, prior_widths={name: first * (1.0 + 0.01 * number)}
        )

    return {
        "detectors' priors": widths("detector_x", 10.0),
        "sources' priors": widths("sources", 1.5),
        "order 6 to 5, precomputed": widths("sources", 1.2, order=5),
        "some sources left out": corner,
    }


def stages(fitter: OrbitFitter, settings: FitSettings, directory: Path) -> dict[str, float]:
    """Return the seconds of each stage of one what-if, and of all."""
    begin = time.perf_counter()
    found = fitter.partial_what_if(settings)
    if found is None:
        sys.exit(f"no what-if for {settings}")
    solved = time.perf_counter()
    write_scratch_result(directory, found.result, is_partial=True, is_judged=False)
    end = time.perf_counter()
    write_verdict(directory, with_verdict(found.result).summary["verdict"])
    judged = time.perf_counter()
    # The largest parts of the diagnosis once more, alone.
    solution, spent = found.solution, dict(found.result.summary["seconds"])
    with one_blas_thread():
        for_covariances = time_of(lambda: covariances(solution.reduced), 1)
        at = (solution.mode.theta, solution.mode.sources, solution.covariance)
        for_leverage = time_of(lambda: residuals(solution.problem, *at), 1)
    return {
        "prepare": spent["prepare"],
        "solve": spent["fit"],
        "covariances": for_covariances,
        "leverage": for_leverage,
        "the tables": solved
        - begin
        - spent["prepare"]
        - spent["fit"]
        - for_covariances
        - for_leverage,
        "write": end - solved,
        "all": end - begin,
        "verdict": judged - end,
    }


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time what-ifs of a full-size orbit.")
    parser.add_argument("--sources", type=int, default=7000, help="approximate number in the orbit")
    parser.add_argument("--repeat", type=int, default=7, help="what-ifs of each kind")
    return parser.parse_args()


if __name__ == "__main__":
    main()
