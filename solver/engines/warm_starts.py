"""Starts: solutions kept at hand from which a change of settings is a short way."""

from collections.abc import Iterable
from typing import NamedTuple

from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode
from solver.problem.problem import Problem

# Beyond this, what is likely to be asked is not kept.
_MOST_BYTES = 2**29


class WarmStart(NamedTuple):
    """A problem, linearised where it is solved."""

    settings: FitSettings
    problem: Problem
    mode: Mode


def nearest(starts: Iterable[WarmStart], settings: FitSettings) -> WarmStart | None:
    """Return the start of the lowest order that holds what is asked for; None if none does."""
    holding = [start for start in starts if start.settings.order >= settings.order]
    return min(holding, key=lambda start: start.settings.order, default=None)


def likely(start: WarmStart, order: int) -> list[FitSettings]:
    """Return what is likely to be asked of a solution and takes longer than other priors do.

    A lower order needs Jacobians of its own.

    Parameters
    ----------
    order : on the screen; the one below it is likely to be next

    Returns
    -------
    That order and the other lower ones from there, as many as there is memory for
    """
    # Order 0 has no terms, as the first has none.
    below = sorted(range(1, start.settings.order), key=lambda lower: abs(lower - (order - 1)))
    most = _MOST_BYTES // start.mode.equations.cross.nbytes
    return [start.settings.with_(order=lower) for lower in below[:most]]
