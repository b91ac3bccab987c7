"""fit_orbit: one orbit in, one result out; the engines' common front."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import pandas as pd

from solver.data.instrument import MINI_MOCK, Instrument
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Iteration, Mode, find_mode
from solver.engines.robust import find_outliers, outlier_table
from solver.engines.run_engine import Resumption, run_engine
from solver.engines.warm_starts import WarmStart, likely, nearest
from solver.engines.what_if import linearised, solve_what_if
from solver.errors import FitError, InputError
from solver.linear.leverage import Covariances
from solver.problem.problem import Problem, orders_held, rebuilt
from solver.problem.problem_cache import ProblemCache
from solver.results.eigenmode_tables import eigenmode_tables
from solver.results.orders import compare_orders
from solver.results.source_history import history_table
from solver.results.summary import summarise, truth_summary
from solver.results.tables import (
    SolvedProblem,
    calibration_table,
    exposure_table,
    loss_table,
    residual_table,
    solved_problem,
    source_table,
    trace_table,
    true_places,
)
from solver.runtime.device import require_device


def fit_orbit(
    data: OrbitData,
    instrument: Instrument = MINI_MOCK,
    settings: FitSettings | None = None,
    progress: Callable[[Iteration], None] = lambda _: None,
    resumption: Resumption | None = None,
) -> FitResult:
    """Solve one orbit.

    Parameters
    ----------
    data : checked tables, as from `solver.read_orbit`
    instrument : nominal focal plane; its detectors' ids are those of the measurements
    settings : the defaults are the paper's
    progress : called after every iteration; what it raises stops the fit
    resumption : where the svi engine is to go on, and who keeps its state

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
    return OrbitFitter(data, instrument).fit(settings or FitSettings(), progress, resumption)


class _Fitted(NamedTuple):
    """What the last fit leaves for the next question."""

    settings: FitSettings
    problem: Problem
    mode: Mode
    covariance: Covariances
    outliers: pd.DataFrame | None
    orders: pd.DataFrame | None


class OrbitFitter:
    """One orbit, fitted again and again: it keeps what a change of settings can start from."""

    def __init__(self, data: OrbitData, instrument: Instrument = MINI_MOCK) -> None:
        """Take checked tables, as from `solver.read_orbit`; InputError if JAX has no device."""
        require_device()
        self._selection = ProblemCache(data, instrument)
        self._orbit_id = data.orbit_id
        self._instrument = instrument
        self._kept: _Fitted | None = None
        self._starts: list[WarmStart] = []
        self._tried: list[FitSettings] = []
        self._stopped: tuple[FitSettings, object] | None = None

    def fit(
        self,
        settings: FitSettings,
        progress: Callable[[Iteration], None] = lambda _: None,
        resumption: Resumption | None = None,
    ) -> FitResult:
        """Solve the orbit from the start; arguments and errors as those of `fit_orbit`.

        A run of the svi engine that was stopped is gone on with where it was.
        """
        start = time.perf_counter()
        data, problem = self._selection.choose(settings)
        outliers = None
        if settings.robust:
            outliers = outlier_table(find_outliers(problem, settings, progress), problem, data)
            data, problem = self._selection.choose(settings, outliers)
        prepared = time.perf_counter()
        found = run_engine(problem, settings, progress, resumption or self._resumption(settings))
        result, solution = _result(
            data, self._instrument, settings, problem, found, (start, prepared)
        )
        self._stopped = None
        fitted = time.perf_counter()
        orders = self._compare_orders(problem, settings, progress)
        if found.mode.status.is_solution:
            self._kept = _Fitted(
                settings, problem, found.mode, solution.covariance, outliers, orders
            )
            self._starts, self._tried = [WarmStart(settings, problem, found.mode)], [settings]
        result = _with_outliers(result, outliers)
        return _with_orders(result, orders, time.perf_counter() - fitted)

    def what_if(self, settings: FitSettings) -> FitResult | None:
        """Return the solution under other settings by one step from the last fit.

        The outliers are those of that fit, and so is the comparison of the orders where it
        is the order alone that changes.

        Returns
        -------
        None if there is no fit to start from, or only a refit can tell; see
        `solver.engines.what_if.solve_what_if`.
        """
        kept = self._kept
        if kept is None or not kept.settings.what_if_holds(settings):
            return None
        start = time.perf_counter()
        data, problem = self._selection.choose(settings, kept.outliers)
        prepared = time.perf_counter()
        near = nearest(self._starts, settings)
        mode = near and solve_what_if(near.mode, near.problem, problem, settings)
        if mode is None:
            return None
        found = Estimate(mode)
        result, _ = _result(data, self._instrument, settings, problem, found, (start, prepared))
        same_but_order = settings == kept.settings.with_(order=settings.order)
        orders = kept.orders if same_but_order else None
        return replace(_with_outliers(result, kept.outliers), orders=orders)

    def history(self, result: FitResult) -> pd.DataFrame:
        """Return what the last fit, whose result is given, adds to the history of its sources.

        See `solver.results.source_history.history_table`.

        Raises
        ------
        FitError
            If the last fit is no solution.
        """
        kept = self._kept
        if kept is None or kept.settings != result.settings or kept.mode.reduced is None:
            raise FitError(f"orbit {self._orbit_id}: {result.summary['reason']}")
        return history_table(kept.problem, kept.mode.reduced, kept.covariance, result)

    def get_ready(self, order: int) -> Iterator[None]:
        """Prepare, while nobody waits, for what may be asked of the last fit next.

        See `solver.engines.warm_starts.likely`; with that, it takes no longer than other priors do.

        Parameters
        ----------
        order : of the solution on the screen

        Yields
        ------
        Between steps of about a second, so that a question need not wait for the rest.
        """
        kept = self._kept
        if kept is None:
            return
        wanted = likely(self._starts[0], order)
        # Where there is not memory for all, what was likely of another order is not kept.
        self._tried = [kept.settings, *(tried for tried in self._tried if tried in wanted)]
        self._starts = [start for start in self._starts if start.settings in self._tried]
        for settings in wanted:
            if settings not in self._tried:
                self._tried.append(settings)
                self._starts += self._started(kept, settings)
                yield

    def _started(self, kept: _Fitted, settings: FitSettings) -> list[WarmStart]:
        """Return a change of the last fit, linearised at its own solution, where there is one."""
        try:
            _, problem = self._selection.choose(settings, kept.outliers)
        except InputError:
            # A prior is shifted of a term that the lower order has not, or too little is left.
            return []
        mode = solve_what_if(kept.mode, kept.problem, problem, settings)
        # So far may the stars have to move that only a fit can tell.
        mode = mode or find_mode(problem, settings)
        is_solved = mode.status.is_solution
        return [WarmStart(settings, problem, linearised(problem, mode))] if is_solved else []

    def _compare_orders(
        self,
        problem: Problem,
        settings: FitSettings,
        progress: Callable[[Iteration], None],
    ) -> pd.DataFrame | None:
        if not settings.compare_orders:
            return None
        highest = max(orders_held(problem.n_obs, problem.n_src, problem.layout))
        highest_problem = rebuilt(problem, self._instrument, settings.with_(order=highest))
        return compare_orders(highest_problem, settings, progress)

    def _resumption(self, settings: FitSettings) -> Resumption:
        def keep(state: object) -> None:
            self._stopped = settings, state

        asked_again = self._stopped is not None and self._stopped[0] == settings
        return Resumption(self._stopped[1] if asked_again and self._stopped else None, keep)


def _with_outliers(result: FitResult, outliers: pd.DataFrame | None) -> FitResult:
    if outliers is None:
        return result
    summary = {**result.summary, "n_outliers": len(outliers)}
    return replace(result, summary=summary, outliers=outliers.reset_index(drop=True))


def _with_orders(result: FitResult, orders: pd.DataFrame | None, seconds: float) -> FitResult:
    if orders is None:
        return result
    taken = {**dict(result.summary["seconds"]), "orders": seconds}
    return replace(result, summary={**result.summary, "seconds": taken}, orders=orders)


def _result(
    data: OrbitData,
    instrument: Instrument,
    settings: FitSettings,
    problem: Problem,
    found: Estimate,
    times: tuple[float, float],
) -> tuple[FitResult, SolvedProblem]:
    mode = found.mode
    if mode.reduced is None:
        raise FitError(f"orbit {data.orbit_id}: {mode.status.value}")
    start, prepared = times
    solved = time.perf_counter()
    solution = solved_problem(problem, found, mode.reduced)
    sources, places = source_table(solution), true_places(solution, data.truth)
    calibration = calibration_table(solution, instrument)
    tables = {
        "sources": sources,
        "residuals": residual_table(solution, data.measurements),
        "calibration": calibration,
        "exposures": exposure_table(solution),
        "trace": trace_table(mode),
        "true_places": places,
        "losses": loss_table(found.losses),
        **eigenmode_tables(solution, calibration, instrument),
    }
    seconds = {
        "prepare": prepared - start,
        "fit": solved - prepared,
        "diagnose": time.perf_counter() - solved,
    }
    summary = {**summarise(solution, settings, seconds), **found.figures}
    if places is not None:
        summary["truth"] = truth_summary(sources, places)
    result = FitResult(
        **tables, summary=summary, settings=settings, provenance=dict(data.provenance)
    )
    return result, solution
