"""Count the steps after which the svi engine agrees with gauss-newton, on full-size orbits.

    python tests/benchmarks/bench_svi.py [--orbits 3] [--sources 7000]

Each fit starts from the catalogue; each orbit is simulated with another seed. The shift is the
largest distance of any coordinate of a source from the mode, in its marginal sigma.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np

from solver.engines.gauss_newton import find_mode
from solver.data.instrument import MINI_MOCK
from solver.linear.covariances import covariances
from solver.runtime.memory import keep_memory
from solver.problem.problem import Problem, build_problem
from solver.data.settings import FitSettings
from solver.engines.svi import SviState, variational
from tests.benchmarks.machine import machine, write
from tests.benchmarks.orbits import simulated_orbit, survey_of

# Largest shift that counts as agreement, in marginal sigmas.
_AGREES = 0.05
# Steps between two reported shifts.
_REPORT_STEPS = 500


def main() -> None:
    arguments = parse_arguments()
    keep_memory()
    write(machine())
    survey, settings = survey_of(arguments.sources), FitSettings(engine="svi")
    for seed in range(arguments.orbits):
        data = simulated_orbit(replace(survey, seed=seed))
        report_agreement(build_problem(data, MINI_MOCK, settings), settings, seed)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Count the steps of the svi engine.")
    parser.add_argument(
        "--orbits", type=int, default=3, help="number of orbits to simulate and fit"
    )
    parser.add_argument(
        "--sources", type=int, default=7000, help="approximate number in each orbit"
    )
    return parser.parse_args()


def report_agreement(problem: Problem, settings: FitSettings, seed: int) -> None:
    exact = find_mode(problem, settings)
    if exact.reduced is None:
        sys.exit(f"the simulated orbit {seed} has no solution")
    marginal = sigmas(covariances(exact.reduced).source)
    shifts: dict[int, float] = {}

    def keep(state: SviState) -> None:
        shifts[state.step] = float(np.abs((state.sources - exact.sources) / marginal).max())

    start = time.perf_counter()
    found = variational(problem, settings, keep=keep)
    seconds = time.perf_counter() - start
    last_disagreement = max((step for step, shift in shifts.items() if shift > _AGREES), default=0)
    write(f"\norbit of seed {seed}: {problem.n_obs} measurements of {problem.n_src} sources")
    write("  " + ", ".join(f"{n}: {shifts[n]:.3g}" for n in shifts if n % _REPORT_STEPS == 0))
    write(f"  means within {_AGREES} after step {last_disagreement}")
    write(f"  {found.mode.status.value}: step {max(shifts)}, {seconds:.0f} s")
    if found.conditional is not None:
        change = sigmas(found.conditional) / sigmas(exact.reduced.conditional_covariance())
        write(f"  largest change of a conditional sigma: {np.abs(change - 1.0).max():.2%}")


def sigmas(covariance: np.ndarray) -> np.ndarray:
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


if __name__ == "__main__":
    main()
