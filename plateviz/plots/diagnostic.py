"""Diagnostic: one picture of a solution, with its title, its caption and what it shows.

A module of this package that defines `DIAGNOSTICS` is on the Orbit page, and in every
report, without being named anywhere else (`plateviz.plots.gallery` finds it): a new diagnostic
is its table in `plateviz.tables` and its plot here.
"""

from collections.abc import Callable
from dataclasses import dataclass

import holoviews as hv

from solver.data.instrument import Instrument
from solver.data.result import FitResult


@dataclass(frozen=True)
class Chosen:
    """What a diagnostic is drawn from.

    Attributes
    ----------
    result : the solution
    instrument : that took the orbit
    exposures : chosen ones as (field_id, plate_id)
    detector : chosen detector_id, or None for all
    other : solution to compare with, or None
    """

    result: FitResult
    instrument: Instrument
    exposures: tuple[tuple[int, int], ...] = ()
    detector: int | None = None
    other: FitResult | None = None


def _always(_: Chosen) -> bool:
    return True


@dataclass(frozen=True)
class Diagnostic:
    """One picture of a solution.

    Attributes
    ----------
    name : short and unique, used in addresses and file names
    title : for people
    caption : what it shows and what good looks like, in a sentence or two
    order : place on the page
    draw : picture of what is chosen, in a theme
    follows_selection : whether exposures and detector change it
    is_wide : whether it takes the whole width of the page
    has_data : whether there is anything to draw, such as a truth or another solution
    """

    name: str
    title: str
    caption: str
    order: int
    draw: Callable[[Chosen, str], hv.core.Dimensioned]
    follows_selection: bool = False
    is_wide: bool = False
    has_data: Callable[[Chosen], bool] = _always
