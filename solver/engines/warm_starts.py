"""Warm starts: linearised solutions from which changed settings are solved quickly."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode, find_mode
from solver.engines.what_if import solve_what_if
from solver.errors import InputError
from solver.linear.update import update_equations
from solver.problem.problem import Problem

# Memory for precomputed warm starts, bytes.
_MAX_BYTES = 2**29
# Longest step of a what-if, sigma. After steps of up to 7 the calibration of full orbits was off by
# 0.001 sigma at most, after 12 by 0.02, after longer ones, to an order far too low, by up to 0.3.
_LONGEST = 25.0
# How near its mode a lower order is solved that somebody waits for, sigma.
_NEAR = 0.3


class WarmStart(NamedTuple):
    """A problem with its solution, linearised there."""

    settings: FitSettings
    problem: Problem
    mode: Mode


class WarmStarts:
    """A fit, and the solutions of lower distortion orders that were made from it."""

    def __init__(self, fit: WarmStart, problem_of: Callable[[FitSettings], Problem]) -> None:
        """Begin with a fit alone.

        Parameters
        ----------
        problem_of : returns the problem of other settings, with what the fit adjusted
        """
        self._fit, self._problem_of = fit, problem_of
        self._lower: dict[int, WarmStart | None] = {}

    def solution(self, problem: Problem, settings: FitSettings) -> Mode | None:
        """Return the mode of a changed problem, or None if it needs a fit of its own.

        It is found by a step, or where the model is not linear enough for one, by iterations that
        begin at the warm start. A lower order is solved first, with the priors that are asked for
        but all measurements, for this what-if and those that follow it.
        """
        self._add(settings.with_(exclusions=self._fit.settings.exclusions), _NEAR)
        base = self._nearest(settings.order)
        if base.settings.order < settings.order:
            return None
        mode = solve_what_if(base.mode, base.problem, problem, settings, _LONGEST)
        return mode or _iterated(base, problem, settings)

    def add(self, order: int) -> bool:
        """Solve a lower order than that of the fit, once; return whether it was not tried before.

        It may have no solution.
        """
        settings = self._fit.settings.with_(order=order)
        if not self._add(settings, settings.tolerance):
            return False
        self._lower.setdefault(order, None)
        return True

    def likely(self, order: int) -> list[int]:
        """Return the orders of likely what-ifs that need Jacobians of their own: lower ones.

        Parameters
        ----------
        order : the one on the screen; the next lower order is the likeliest

        Returns
        -------
        The likeliest first, as many as fit in memory
        """
        # Order 0 is omitted: like order 1 it has no terms.
        orders = range(1, self._fit.settings.order)
        below = sorted(orders, key=lambda lower: abs(lower - (order - 1)))
        return below[: _MAX_BYTES // self._fit.mode.equations.cross.nbytes]

    def keep(self, orders: Iterable[int]) -> None:
        """Forget the solutions of all lower orders but these."""
        kept = set(orders)
        self._lower = {order: one for order, one in self._lower.items() if order in kept}

    def _add(self, settings: FitSettings, tolerance: float) -> bool:
        """Solve a lower order that was not tried before; return whether it was not."""
        order = settings.order
        if order >= self._fit.settings.order or order in self._lower:
            return False
        solved = self._solved(settings, tolerance)
        if solved is not None:
            self._lower[order] = solved
        return True

    def _nearest(self, order: int) -> WarmStart:
        """Return the solution of the lowest order that suffices, or the fit if there is none."""
        orders = [n for n, one in self._lower.items() if one is not None and n >= order]
        return (self._lower[min(orders)] if orders else None) or self._fit

    def _solved(self, settings: FitSettings, tolerance: float) -> WarmStart | None:
        """Solve a lower order; None if it has no solution.

        It is too far for a step: new Jacobians on the way take less time than a step that fails.
        """
        problem, base = self._problem(settings), self._nearest(settings.order)
        mode = problem and _iterated(base, problem, settings.with_(tolerance=tolerance))
        return WarmStart(settings, problem, mode) if problem and mode else None

    def _problem(self, settings: FitSettings) -> Problem | None:
        try:
            return self._problem_of(settings)
        except InputError:
            # A prior is shifted for a term that the lower order lacks, or too few data remain.
            return None


def _iterated(start: WarmStart, problem: Problem, settings: FitSettings) -> Mode | None:
    """Return the mode of a changed problem by iterations; None if there is none to be found."""
    equations = update_equations(start.mode.equations, start.problem, problem)
    mode = equations and find_mode(problem, settings, start=equations)
    return mode if mode and mode.status.is_solution else None
