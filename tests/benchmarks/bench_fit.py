"""Time one full-size fit, warm, in units of one matrix product.

    python tests/benchmarks/bench_fit.py [--sources 7000] [--repeat 5]

One unit is NumPy's `Z.T @ Z` for a float64 Z of 2 x sources rows and as many columns as
there are calibration parameters: the largest product that the elimination of the sources
needs. It is timed in the same run, so that results of different machines compare.
"""

import argparse
import os
import platform
import resource
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from importlib import metadata
from pathlib import Path

# The checkout is measured, wherever it is run from.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

# Before NumPy, as in the program: it sets how long idle BLAS threads spin.
import solver  # noqa: F401, I001

import numpy as np

from solver.exclusions import Exclusions
from solver.fit import fit_orbit
from solver.gauss_newton import Mode, find_mode
from solver.instrument import MINI_MOCK
from solver.leverage import covariances, residuals
from solver.normal import accumulate
from solver.objective import gradient
from solver.orbit import OrbitData
from solver.problem import Problem, build_problem
from solver.schur import Reduced, reduce
from solver.settings import FitSettings
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.measure import measure_orbit
from solver.simulate.settings import SurveySettings
from solver.svi import blocks, start_state
from solver.what_if import re_solve

ORBIT = 0
# What the paper's catalogue of 132,651 stars leaves on the detectors in that orbit.
SOURCES_OF_THE_PAPER = 6480
UNIT_REPEATS = 5
CHANGES = {
    "sources' priors": (FitSettings(), FitSettings(prior_widths={"sources": 2.0})),
    "detectors' priors": (FitSettings(), FitSettings(prior_widths={"detector_x": 10.0})),
    "no detector 1": (FitSettings(), FitSettings(exclusions=Exclusions(detectors=frozenset([1])))),
    # From one order more than the distortion has, so that the lower one fits as well.
    "order 6 to 5": (FitSettings(order=6), FitSettings()),
}
PACKAGES = ("numpy", "scipy", "jax", "jaxlib")


def main() -> None:
    arguments = parse_arguments()
    data = full_size_orbit(arguments.sources)
    settings = FitSettings()
    problem = build_problem(data, MINI_MOCK, settings)
    # Warm: everything compiled, memory touched.
    warm = fit_orbit(data, MINI_MOCK, settings)
    # Before the other stages, which keep several solutions at once.
    peak = peak_memory_mib()
    unit = time_of(unit_product(problem), UNIT_REPEATS)
    timings = {
        name: time_of(work, arguments.repeat)
        for name, work in stages(data, problem, settings).items()
    }
    # A step is timed as its share of a block, linearisations included.
    timings["svi, one step"] /= settings.svi.block
    write(machine())
    write(
        f"{problem.n_obs} measurements, {problem.n_src} sources, "
        f"{len(problem.exposures)} exposures, {problem.layout.size} calibration parameters"
    )
    write(f"converged: {warm.summary['converged']}, iterations: {warm.summary['iterations']}")
    write(f"unit: Z.T @ Z, Z of {2 * problem.n_src} x {problem.layout.size}: {unit:.4f} s\n")
    write(f"{'stage':<44}{'seconds':>9}{'units':>9}")
    for name, seconds in timings.items():
        write(f"{name:<44}{seconds:9.3f}{seconds / unit:9.1f}")
    write(f"\npeak memory of one fit, simulation included: {peak:.0f} MiB")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time one full-size fit.")
    parser.add_argument("--sources", type=int, default=7000, help="about as many in the orbit")
    parser.add_argument("--repeat", type=int, default=5, help="runs of each stage; medians count")
    return parser.parse_args()


def full_size_orbit(sources: int) -> OrbitData:
    """Simulate an orbit of the mini-mock survey with about so many sources."""
    share = sources / SOURCES_OF_THE_PAPER
    paper = SurveySettings()
    survey = SurveySettings(
        n_stars=round(share * paper.n_stars),
        n_reference=round(share * paper.n_reference),
        n_artificial=round(share * paper.n_artificial),
    )
    truth = truth_catalogue(survey)
    measured = measure_orbit(ORBIT, truth, survey, MINI_MOCK)
    catalogue = reference_catalogue(truth, survey)
    return OrbitData(measured.measurements, measured.exposures, catalogue, truth)


def unit_product(problem: Problem) -> Callable[[], object]:
    shape = (2 * problem.n_src, problem.layout.size)
    matrix = np.random.default_rng(0).standard_normal(shape)
    return lambda: matrix.T @ matrix


def stages(
    data: OrbitData, problem: Problem, settings: FitSettings
) -> dict[str, Callable[[], object]]:
    """Return what is timed, by name."""
    mode = find_mode(problem, settings)
    theta, sources = mode.theta, mode.sources
    equations = accumulate(problem, theta, sources)
    reduced = reduce(equations, problem.priors)
    if reduced is None:
        sys.exit("the simulated orbit has no solution")
    covariance = covariances(reduced)
    return {
        "build_problem": lambda: build_problem(data, MINI_MOCK, settings),
        "accumulate, one linearisation pass": lambda: accumulate(problem, theta, sources),
        "gradient, one pass": lambda: gradient(problem, theta, sources),
        "reduce": lambda: reduce(equations, problem.priors),
        "marginal covariances of the sources": lambda: marginal_sigmas(reduced),
        "all covariances": lambda: covariances(reduced),
        "residuals with leverage": lambda: residuals(problem, theta, sources, covariance),
        "from the catalogue to marginal sigmas": lambda: fit_with_sigmas(problem, settings),
        **{f"what if: {name}": what_if(data, *change) for name, change in CHANGES.items()},
        "svi, one step": svi_block(problem, settings, mode),
        "fit_orbit, with all tables": lambda: fit_orbit(data, MINI_MOCK, settings),
    }


def fit_with_sigmas(problem: Problem, settings: FitSettings) -> object:
    # A problem of its own, whose tiles are still to be laid.
    reduced = find_mode(replace(problem), settings).reduced
    return None if reduced is None else marginal_sigmas(reduced)


def what_if(data: OrbitData, before: FitSettings, after: FitSettings) -> Callable[[], object]:
    """Return the re-solution of one change, from a fit made and a problem built beforehand."""
    solved = build_problem(data, MINI_MOCK, before)
    changed = build_problem(after.exclusions.without(data), MINI_MOCK, after)
    mode = find_mode(solved, before)

    def work() -> object:
        found = re_solve(mode, solved, changed, after)
        if found is None or found.reduced is None:
            sys.exit(f"no re-solution from {before} to {after}")
        return marginal_sigmas(found.reduced)

    return work


def svi_block(problem: Problem, settings: FitSettings, mode: Mode) -> Callable[[], object]:
    """Return one block of steps from the mode."""
    start = start_state(problem, settings.svi)._replace(theta=mode.theta, sources=mode.sources)
    work = lambda: next(blocks(problem, settings, start))  # noqa: E731 timed as the others are
    work()
    return work


def marginal_sigmas(reduced: Reduced) -> object:
    return reduced.marginal_covariance(reduced.spread())


def time_of(work: Callable[[], object], repeat: int) -> float:
    """Return the median time, s."""
    seconds = []
    for _ in range(repeat):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def machine() -> str:
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in PACKAGES)
    return f"{cpu_model()}, {usable_cores()} cores, Python {platform.python_version()}, {versions}"


def cpu_model() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


def usable_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def peak_memory_mib() -> float:
    # In KiB on Linux, in bytes on macOS.
    per_mib = 1024.0**2 if sys.platform == "darwin" else 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / per_mib


def write(line: str) -> None:
    sys.stdout.write(line + "\n")


if __name__ == "__main__":
    main()
