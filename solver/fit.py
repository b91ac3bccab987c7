"""fit_orbit: one orbit in, one result out; the engines' common front."""

import time
from collections.abc import Callable

from solver.errors import FitError
from solver.gauss_newton import Iteration, Mode, find_mode
from solver.instrument import MINI_MOCK, Instrument
from solver.leverage import covariances, residuals
from solver.orbit import OrbitData
from solver.problem import Problem, build_problem
from solver.result import FitResult, FitStatus
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
from solver.what_if import re_solve


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
    return OrbitFitter(data, instrument).fit(settings or FitSettings(), progress)


class OrbitFitter:
    """One orbit, fitted again and again: it keeps what a change of settings can start from."""

    def __init__(self, data: OrbitData, instrument: Instrument = MINI_MOCK) -> None:
        """Take checked tables, as from `solver.read_orbit`."""
        self._data = data
        self._instrument = instrument
        self._kept: tuple[FitSettings, Problem, Mode] | None = None

    def fit(
        self,
        settings: FitSettings,
        progress: Callable[[Iteration], None] = lambda _: None,
    ) -> FitResult:
        """Solve the orbit from the start; arguments and errors as those of `fit_orbit`."""
        start = time.perf_counter()
        data = settings.exclusions.without(self._data)
        problem = build_problem(data, self._instrument, settings)
        prepared = time.perf_counter()
        mode = find_mode(problem, settings, progress)
        result = _result(data, self._instrument, settings, problem, mode, (start, prepared))
        if mode.status is FitStatus.CONVERGED:
            self._kept = settings, problem, mode
        return result

    def what_if(self, settings: FitSettings) -> FitResult | None:
        """Return the solution under other settings by one step from the last fit.

        Returns
        -------
        None if there is no fit to start from, or only a refit can tell; see
        `solver.what_if.re_solve`.
        """
        if self._kept is None or self._kept[0].aberration != settings.aberration:
            return None
        start = time.perf_counter()
        data = settings.exclusions.without(self._data)
        problem = build_problem(data, self._instrument, settings)
        prepared = time.perf_counter()
        mode = re_solve(self._kept[2], self._kept[1], problem, settings)
        if mode is None:
            return None
        return _result(data, self._instrument, settings, problem, mode, (start, prepared))


def _result(
    data: OrbitData,
    instrument: Instrument,
    settings: FitSettings,
    problem: Problem,
    mode: Mode,
    times: tuple[float, float],
) -> FitResult:
    if mode.reduced is None:
        raise FitError(f"orbit {data.orbit_id}: {mode.status.value}")
    start, prepared = times
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
