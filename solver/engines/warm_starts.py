"""Warm starts: linearised solutions from which changed settings are solved quickly."""

from collections.abc import Iterable
from typing import NamedTuple

from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode
from solver.problem.problem import Problem

# Memory for precomputed warm starts, bytes.
_MAX_BYTES = 2**29


class WarmStart(NamedTuple):
    """A problem with its solution, linearised there."""

    settings: FitSettings
    problem: Problem
    mode: Mode


def nearest(starts: Iterable[WarmStart], settings: FitSettings) -> WarmStart | None:
    """Return the warm start of the lowest sufficient distortion order, or None."""
    sufficient = [start for start in starts if start.settings.order >= settings.order]
    return min(sufficient, key=lambda start: start.settings.order, default=None)


def likely(start: WarmStart, order: int) -> list[FitSettings]:
    """Return the settings of likely what-ifs that need Jacobians of their own: lower orders.

    Parameters
    ----------
    order : the one on the screen; the next lower order is the likeliest

    Returns
    -------
    Settings of lower orders, likeliest first, as many as fit in memory
    """
    # Order 0 is omitted: like order 1 it has no terms.
    below = sorted(range(1, start.settings.order), key=lambda lower: abs(lower - (order - 1)))
    count = _MAX_BYTES // start.mode.equations.cross.nbytes
    return [start.settings.with_(order=lower) for lower in below[:count]]
