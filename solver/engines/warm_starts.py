"""Warm starts: linearised solutions from which changed settings are solved quickly."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode, find_mode
from solver.engines.what_if import linearised, solve_what_if
from solver.errors import InputError
from solver.problem.problem import Problem

# Memory for precomputed warm starts, bytes.
_MAX_BYTES = 2**29


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
        self._latest = fit.settings.order

    def step(self, problem: Problem, settings: FitSettings) -> Mode | None:
        """Return the mode of a changed problem by a step, or None if it needs a fit.

        A lower order that is too far for a step is solved for this what-if and those that follow.
        """
        mode = self._step(problem, settings)
        if mode is None and self._is_new(settings.order):
            self._lower[settings.order] = self._fitted(settings.order)
            mode = self._step(problem, settings)
        return mode

    def add(self, order: int) -> bool:
        """Solve a lower order than that of the fit, once; return whether it was not tried before.

        It may have no solution.
        """
        if not self._is_new(order):
            return False
        self._lower[order] = self._stepped(order) or self._fitted(order)
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

    def forget(self) -> None:
        """Forget the solutions of all lower orders but that of the latest what-if."""
        self.keep([self._latest])

    def _is_new(self, order: int) -> bool:
        return order < self._fit.settings.order and order not in self._lower

    def _step(self, problem: Problem, settings: FitSettings) -> Mode | None:
        """Start from the lowest order that suffices."""
        orders = [n for n, one in self._lower.items() if one is not None and n >= settings.order]
        base = (self._lower[min(orders)] if orders else None) or self._fit
        self._latest = base.settings.order
        if base.settings.order < settings.order:
            return None
        return solve_what_if(base.mode, base.problem, problem, settings)

    def _stepped(self, order: int) -> WarmStart | None:
        """Solve a lower order by a step from the fit; None if it is too far for one."""
        found = self._problem(order)
        mode = found and solve_what_if(self._fit.mode, self._fit.problem, found[1], found[0])
        return WarmStart(*found, linearised(found[1], mode)) if found and mode else None

    def _fitted(self, order: int) -> WarmStart | None:
        """Fit a lower order; None if it has no solution."""
        found = self._problem(order)
        mode = found and find_mode(found[1], found[0])
        return WarmStart(*found, mode) if found and mode and mode.status.is_solution else None

    def _problem(self, order: int) -> tuple[FitSettings, Problem] | None:
        settings = self._fit.settings.with_(order=order)
        try:
            return settings, self._problem_of(settings)
        except InputError:
            # A prior is shifted for a term that the lower order lacks, or too few data remain.
            return None
