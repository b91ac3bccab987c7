"""Fit one orbit with any engine: `fit_orbit`, and `OrbitFitter` for repeated fits."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.instrument import MINI_MOCK, Instrument
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.engines.adjust import find_adjustments, with_adjustments
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Iteration, Mode, find_mode
from solver.engines.run_engine import Resumption, run_engine
from solver.engines.start_tables import StartTables
from solver.engines.warm_starts import WarmStart, WarmStarts
from solver.errors import FitError
from solver.linear.contribution import contribution_of, typical_removals
from solver.linear.covariances import Covariances, covariances
from solver.linear.source_elimination import ReducedSystem
from solver.problem.adjustments import Adjustments
from solver.problem.problem import Problem, orders_held, rebuilt
from solver.problem.problem_cache import ProblemCache
from solver.results.catalogue_response import sky_statistics
from solver.results.orbit_result import Beginnings, PartialResult, partial_result
from solver.results.orders import compare_orders, with_orders
from solver.results.source_history import history_table
from solver.runtime.device import require_device
from solver.runtime.interruption import attempts


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
    data : checked tables, as returned by `solver.read_orbit`
    instrument : nominal focal plane, with the detector ids of the measurements
    settings : defaults to those of the paper
    progress : called after every iteration; an exception from it stops the fit
    resumption : state from which the svi engine continues, and the callback that saves it

    Returns
    -------
    The result, converged or not: see `summary["converged"]` and `summary["reason"]`.

    Raises
    ------
    InputError
        If the settings exclude data that do not exist, or need more data than there are.
    FitError
        If no solution with uncertainties exists; the message gives the reason.
    """
    return OrbitFitter(data, instrument).fit(settings or FitSettings(), progress, resumption)


class _LastFit(NamedTuple):
    """State of the last fit, from which what-if solutions start.

    `covariance` and `orders` are None where nothing has needed them.
    """

    settings: FitSettings
    problem: Problem
    mode: Mode
    adjustments: Adjustments
    covariance: Covariances | None = None
    orders: pd.DataFrame | None = None


class OrbitFitter:
    """Fit one orbit repeatedly, reusing the last fit when settings change."""

    def __init__(self, data: OrbitData, instrument: Instrument = MINI_MOCK) -> None:
        """Take checked tables, as from `solver.read_orbit`.

        Raises
        ------
        InputError
            If JAX has no device.
        """
        require_device()
        self._cache = ProblemCache(data, instrument)
        self._orbit_id = data.orbit_id
        self._instrument = instrument
        self._last_fit: _LastFit | None = None
        self._starts: WarmStarts | None = None
        # Measurements of the last fit without which nothing has been compiled yet.
        self._to_compile: list[np.ndarray] = []
        self._stopped: tuple[FitSettings, object] | None = None

    def fit(
        self,
        settings: FitSettings,
        progress: Callable[[Iteration], None] = lambda _: None,
        resumption: Resumption | None = None,
        beside: Callable[[Iteration], None] | None = None,
    ) -> FitResult:
        """Fit the orbit; parameters and exceptions as those of `fit_orbit`.

        A fit of the svi engine that was stopped continues where it stopped.

        Parameters
        ----------
        beside : called after every iteration of the Gauss-Newton fits before and after that of the
            engine, which find outliers and compare orders; as `progress` if None
        """
        start, beside = time.perf_counter(), beside or progress
        adjustments = find_adjustments(self._cache, self._instrument, settings, beside)
        data, problem = self._cache.get(settings, adjustments)
        began = Beginnings(start, time.perf_counter())
        estimate = run_engine(problem, settings, progress, resumption or self._resumption(settings))
        found = partial_result(data, self._instrument, settings, problem, estimate, began)
        result = found.whole()
        self._stopped = None
        fitted = time.perf_counter()
        orders = self._compare_orders(problem, settings, beside)
        if estimate.mode.status.is_solution:
            covariance = found.solution.covariance
            self._start_from(
                _LastFit(settings, problem, estimate.mode, adjustments, covariance, orders)
            )
        result = with_adjustments(result, adjustments)
        return with_orders(result, orders, time.perf_counter() - fitted)

    def prepare_what_ifs(
        self,
        settings: FitSettings,
        progress: Callable[[Iteration], None] = lambda _: None,
        solution: StartTables | None = None,
    ) -> None:
        """Fit the orbit so that what-ifs can start from it, without the tables of a result.

        Parameters and exceptions are those of `fit`; the engine is gauss-newton, and distortion
        orders are not compared. A fit that starts from its `solution` takes a single step.

        Raises
        ------
        FitError
            If the fit did not converge; what-ifs start from the fit before, if there is one.
        """
        adjustments = find_adjustments(self._cache, self._instrument, settings, progress)
        _, problem = self._cache.get(settings, adjustments)
        start = None if solution is None else solution.point(problem)
        mode = find_mode(problem, settings, progress, start)
        if start is not None and not mode.status.is_solution:
            # It was no solution of this orbit.
            mode = find_mode(problem, settings, progress)
        if not mode.status.is_solution:
            raise FitError(f"orbit {self._orbit_id}: {mode.status.value}")
        self._start_from(_LastFit(settings, problem, mode, adjustments))

    def _start_from(self, last: _LastFit) -> None:
        """Let what-ifs start from a fit."""
        self._last_fit = last
        fit = WarmStart(last.settings, last.problem, last.mode)
        self._starts = WarmStarts(fit, lambda other: self._cache.get(other, last.adjustments)[1])
        self._to_compile = typical_removals(last.problem)

    @property
    def fitted_settings(self) -> FitSettings | None:
        """The settings of the last fit with a solution; None if there is none."""
        return self._last_fit.settings if self._last_fit else None

    def what_if(self, settings: FitSettings) -> FitResult | None:
        """Return the solution under other settings without a refit.

        Outliers, moves of detectors and the noise model are those of the last fit. So is the
        comparison of distortion orders, if only the order differs.

        Returns
        -------
        The result; None if there is no fit to start from, or if a refit is needed (see
        `solver.engines.warm_starts.WarmStarts.solution`).
        """
        found = self.partial_what_if(settings)
        return None if found is None else found.whole()

    def partial_what_if(self, settings: FitSettings) -> PartialResult | None:
        """Return the same as `what_if`, but for the eigenmodes, which can be computed later."""
        last = self._last_fit
        if last is None or not last.settings.what_if_holds(settings):
            return None
        start = time.perf_counter()
        data, problem = self._cache.get(settings, last.adjustments)
        began = Beginnings(start, time.perf_counter())
        mode = self._starts and self._starts.solution(problem, settings)
        if mode is None:
            return None
        estimate = Estimate(mode)
        found = partial_result(data, self._instrument, settings, problem, estimate, began)
        same_but_order = settings == last.settings.with_(order=settings.order)
        orders = last.orders if same_but_order else None
        result = with_adjustments(found.result, last.adjustments)
        result = replace(result, orders=orders)
        return found._replace(result=result)

    def history(self, result: FitResult) -> pd.DataFrame:
        """Return what the last fit, whose result this is, adds to its sources' `history_table`.

        Raises
        ------
        FitError
            If the last fit has no solution.
        """
        last, reduced = self._solved(result)
        covariance = last.covariance or covariances(reduced)
        return history_table(last.problem, reduced, covariance, result)

    def sky_statistics(self, result: FitResult) -> dict[str, pd.DataFrame]:
        """Return the `sky_statistics` of the last fit, whose result this is.

        Raises
        ------
        FitError
            If the last fit has no solution.
        """
        last, reduced = self._solved(result)
        return sky_statistics(last.problem, reduced, result)

    def _solved(self, result: FitResult) -> tuple[_LastFit, ReducedSystem]:
        last = self._last_fit
        reduced = None if last is None else last.mode.reduced
        if last is None or last.settings != result.settings or reduced is None:
            raise FitError(f"orbit {self._orbit_id}: {result.summary['reason']}")
        return last, reduced

    def precompute(self, order: int) -> Iterator[None]:
        """Precompute warm starts for the what-if solutions that are likely to come next.

        These are lower orders (`WarmStarts.likely`); with a warm start they take no longer than a
        change of priors. What those with fewer measurements need is compiled.

        Parameters
        ----------
        order : distortion order of the solution shown now

        Yields
        ------
        None after each step of up to a second, and where one was interrupted and is begun anew, so
        that the caller can handle a request in between.
        """
        if self._starts is None:
            return
        wanted = self._starts.likely(order)
        # Memory is limited: drop the warm starts that are no longer likely to be used.
        self._starts.keep(wanted)
        for lower in wanted:
            yield from attempts(partial(self._starts.add, lower))
        while self._to_compile:
            yield from attempts(self._compile)

    def _compile(self) -> None:
        if self._last_fit is not None:
            _, problem, mode, *_ = self._last_fit
            contribution_of(mode.equations, problem, self._to_compile[0])
        self._to_compile.pop(0)

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
        def save(state: object) -> None:
            self._stopped = settings, state

        is_same_fit = self._stopped is not None and self._stopped[0] == settings
        return Resumption(self._stopped[1] if is_same_fit and self._stopped else None, save)
