"""Time the stages of one full-size fit in a warm process, in units of one matrix product.

    python tests/benchmarks/bench_fit.py [--sources 7000] [--repeat 5]

One unit is NumPy's `Z.T @ Z` for a float64 Z of 2 x sources rows and as many columns as
there are calibration parameters: the largest product that the elimination of the sources
needs. It is timed before and after each stage, so that results of different machines can be
compared. Each row is written as soon as it is known: a run that is ended early has told what it
found.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Imported before NumPy, as in the program, because it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

from plateviz.verdict.verdict import with_verdict
from solver.data.subset import Subset
from solver.fit import fit_orbit
from solver.engines.gauss_newton import Mode, find_mode
from solver.data.instrument import MINI_MOCK
from solver.linear.covariances import covariances, marginal_covariance
from solver.linear.leverage import residuals
from solver.runtime.memory import keep_memory
from solver.linear.normal_equations import accumulate
from solver.linear.chi2 import gradient
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.problem.problem import Problem, build_problem, rebuilt
from solver.linear.source_elimination import eliminate_sources
from solver.data.settings import FitSettings
from solver.engines.svi import blocks, start_state
from tests.benchmarks.machine import device, machine, peak_memory_mib, time_of, write
from tests.benchmarks.orbits import simulated_orbit, survey_of
from tests.benchmarks.stages import (
    UNIT_REPEATS,
    fit_with_sigmas,
    unit_product,
    what_if,
)

# 576 parameters more than by default.
WALKING = FitSettings(drift_walk=2)
ONE_STEP = "svi, one step"
# Each stage is run again and again for so long, s: the speed of a shared machine varies within it.
LEAST_SECONDS = 3.0


def main() -> None:
    arguments = parse_arguments()
    # As the program does.
    keep_memory()
    data = simulated_orbit(survey_of(arguments.sources))
    settings = FitSettings()
    problem = build_problem(data, MINI_MOCK, settings)
    # Warm up: compile everything and touch the memory.
    warm = fit_orbit(data, MINI_MOCK, settings)
    # Measured before the other stages, which keep several solutions at once.
    peak = peak_memory_mib()
    fit_orbit(data, MINI_MOCK, WALKING)
    write(machine())
    write(f"JAX on {device()}")
    write(
        f"{problem.n_obs} measurements, {problem.n_src} sources, "
        f"{len(problem.exposures)} exposures, {problem.layout.size} calibration parameters"
    )
    write(f"converged: {warm.summary['converged']}, iterations: {warm.summary['iterations']}")
    product = unit_product(problem)
    unit = time_of(product, UNIT_REPEATS)
    write(f"unit: Z.T @ Z, Z of {2 * problem.n_src} x {problem.layout.size}: {unit:.4f} s\n")
    write(f"{'stage':<44}{'seconds':>9}{'units':>9}")
    for name, work in stages(data, problem, settings, warm):
        # Timed beside each stage, because the speed of a shared machine varies.
        before = time_of(product, UNIT_REPEATS)
        seconds = time_of(work, arguments.repeat, LEAST_SECONDS)
        unit = 0.5 * (before + time_of(product, UNIT_REPEATS))
        if name == ONE_STEP:
            # Its share of the linearisations of a block is included.
            seconds /= settings.svi.block
        write(f"{name:<44}{seconds:9.3f}{seconds / unit:9.1f}")
    write(f"\npeak memory of one fit, simulation included: {peak:.0f} MiB")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time one full-size fit.")
    parser.add_argument("--sources", type=int, default=7000, help="approximate number in the orbit")
    parser.add_argument(
        "--repeat",
        type=int,
        default=5,
        help="runs of each stage, more of a short one; medians are reported",
    )
    return parser.parse_args()


def stages(
    data: OrbitData, problem: Problem, settings: FitSettings, fit: FitResult
) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield the name and the work of each stage to be timed.

    Parameters
    ----------
    fit : of these data
    """
    mode = find_mode(problem, settings)
    theta, sources = mode.theta, mode.sources
    equations = accumulate(problem, theta, sources)
    reduced = eliminate_sources(equations, problem.priors)
    if reduced is None:
        sys.exit("the simulated orbit has no solution")
    covariance = covariances(reduced)
    yield "build_problem", lambda: build_problem(data, MINI_MOCK, settings)
    yield "rebuilt, for other settings", lambda: rebuilt(problem, MINI_MOCK, settings)
    yield "accumulate, one linearisation pass", lambda: accumulate(problem, theta, sources)
    yield "gradient, one pass", lambda: gradient(problem, theta, sources)
    yield "reduce", lambda: eliminate_sources(equations, problem.priors)
    yield "marginal covariances of the sources", lambda: marginal_covariance(reduced)
    yield "all covariances", lambda: covariances(reduced)
    yield "residuals with leverage", lambda: residuals(problem, theta, sources, covariance)
    yield "from the catalogue to marginal sigmas", lambda: fit_with_sigmas(problem, settings)
    found = changes(problem)
    for name, change in found.items():
        yield f"what if: {name}", what_if(data, *change)
    for name, change in found.items():
        if name.startswith("order"):
            yield f"what if: {name}, precomputed", what_if(data, *change, is_prepared=True)
    yield ONE_STEP, svi_block(problem, settings, mode)
    walking = build_problem(data, MINI_MOCK, WALKING)
    yield "to marginal sigmas, random walk 2", lambda: fit_with_sigmas(walking, WALKING)
    yield "fit_orbit, with all tables", lambda: fit_orbit(data, MINI_MOCK, settings)
    yield "fit_orbit, random walk 2", lambda: fit_orbit(data, MINI_MOCK, WALKING)
    # Of a copy, which keeps nothing of the time before.
    yield "the verdict on a fit", lambda: with_verdict(replace(fit))


def changes(problem: Problem) -> dict[str, tuple[FitSettings, FitSettings]]:
    """Return by name the settings of a fit and of a what-if."""
    middle = problem.exposures.iloc[len(problem.exposures) // 2]
    reference = problem.sources.loc[problem.sources["is_reference"], "source_id"]
    exclusions = {
        "no reference source": Subset(sources=frozenset([int(reference.iloc[0])])),
        "no exposure": Subset(
            exposures=frozenset([(int(middle["field_id"]), int(middle["plate_id"]))])
        ),
        "no detector 1": Subset(detectors=frozenset([1])),
    }
    default = FitSettings()
    return {
        "sources' priors": (default, FitSettings(prior_widths={"sources": 2.0})),
        "detectors' priors": (default, FitSettings(prior_widths={"detector_x": 10.0})),
        **{name: (default, FitSettings(exclusions=e)) for name, e in exclusions.items()},
        # From one order more than the true one, so that the lower order also fits.
        "order 6 to 5": (FitSettings(order=6), default),
        "order 6 to 2": (FitSettings(order=6), FitSettings(order=2)),
    }


def svi_block(problem: Problem, settings: FitSettings, mode: Mode) -> Callable[[], object]:
    """Return work that makes one block of steps from the mode."""
    start = start_state(problem, settings.svi)._replace(theta=mode.theta, sources=mode.sources)
    work = lambda: next(blocks(problem, settings, start))  # noqa: E731 timed like the others
    work()
    return work


if __name__ == "__main__":
    main()
