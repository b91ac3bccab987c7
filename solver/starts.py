"""Starts: solutions kept at hand from which a change of settings is a short way."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from solver.gauss_newton import Mode
from solver.problem import Problem
from solver.settings import FitSettings

# Beyond this, what is likely to be asked is not kept.
_MOST_BYTES = 2**29


class Start(NamedTuple):
    """A problem, linearised where it is solved."""

    settings: FitSettings
    problem: Problem
    mode: Mode


def nearest(starts: Iterable[Start], settings: FitSettings) -> Start | None:
    """Return the start that holds what is asked for, and the least beside it; None if none does."""
    wanted = settings.exclusions.detectors
    holding = [
        start
        for start in starts
        if start.settings.order >= settings.order and start.settings.exclusions.detectors <= wanted
    ]
    return min(holding, key=_beside, default=None)


def likely(start: Start, order: int, detectors: Sequence[int]) -> list[FitSettings]:
    """Return what is likely to be asked of a solution and takes longer than other priors do.

    A lower order needs Jacobians of its own, and without a detector the model is linear only
    near its solution.

    Parameters
    ----------
    order : on the screen; the one below it is likely to be next
    detectors : detector_id of all that were measured with

    Returns
    -------
    That order, no detector one at a time, and the other lower orders from there; as many of
    them as there is memory for
    """
    fitted, out = start.settings, start.settings.exclusions.detectors
    left = [detector for detector in detectors if detector not in out]
    without = [
        fitted.with_(exclusions=replace(fitted.exclusions, detectors=out | {detector}))
        for detector in (left if len(left) > 1 else [])
    ]
    # Order 0 has no terms, as the first has none.
    below = sorted(range(1, fitted.order), key=lambda lower: abs(lower - (order - 1)))
    lower = [fitted.with_(order=lower) for lower in below]
    return [*lower[:1], *without, *lower[1:]][: _MOST_BYTES // start.mode.equations.cross.nbytes]


def _beside(start: Start) -> tuple[int, int]:
    return start.settings.order, -len(start.settings.exclusions.detectors)
