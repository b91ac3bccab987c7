"""fit_orbit: one orbit in, one result out; the engines' common front."""

import time
from collections.abc import Callable

from solver.errors import FitError
from solver.gauss_newton import Iteration, find_mode
from solver.instrument import MINI_MOCK, Instrument
from solver.leverage import covariances, residuals
from solver.orbit import OrbitData
from solver.problem import build_problem
from solver.result import FitResult
from solver.settings import FitSettings
from solver.summary import summarise, truth_summary
from solver.tables import (
    Solution,
    calibration_table,
    exposure_table,
    residual_table,
    source_table,
    trace_table,
    true_places,
)


def fit_orbit(
    data: OrbitData,
    instrument: Instrument = MINI_MOCK,
    settings: FitSettings | None = None,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> FitResult:
    """Solve one orbit.

    Parameters
    ----------
    data : checked tables, as from `solver.read_orbit`
    instrument : nominal focal plane; its detectors' ids are those of the measurements
    settings : the defaults are the paper's
    progress : called after every iteration; what it raises stops the fit

    Returns
    -------
    The result, whether converged or not: `summary["converged"]` and `summary["reason"]`.

    Raises
    ------
    InputError
        If the data cannot hold what the settings ask for.
    FitError
        If no solution with uncertainties exists; the message says why.
    """
    settings = settings or FitSettings()
    start = time.perf_counter()
    problem = build_problem(data, instrument, settings)
    prepared = time.perf_counter()
    mode = find_mode(problem, settings, progress)
    if mode.reduced is None:
        raise FitError(f"orbit {data.orbit_id}: {mode.status.value}")
    covariance = covariances(mode.reduced)
    solved = time.perf_counter()
    at_mode = residuals(problem, mode.theta, mode.sources, covariance)
    solution = Solution(problem, mode, mode.reduced, covariance, at_mode)
    sources, places = source_table(solution), true_places(solution, data.truth)
    tables = {
        "sources": sources,
        "residuals": residual_table(solution, data.measurements),
        "calibration": calibration_table(solution, instrument),
        "exposures": exposure_table(solution),
        "trace": trace_table(mode),
        "true_places": places,
    }
    seconds = {
        "prepare": prepared - start,
        "fit": solved - prepared,
        "diagnose": time.perf_counter() - solved,
    }
    summary = summarise(solution, settings, seconds)
    if places is not None:
        summary["truth"] = truth_summary(sources, places)
    return FitResult(**tables, summary=summary, settings=settings, provenance=dict(data.provenance))
