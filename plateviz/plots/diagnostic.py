"""Diagnostic: one figure of a solution, with its title, its caption and the function that draws it.

`plateviz.plots.gallery` finds every module of this package that defines `DIAGNOSTICS`, and the
Orbit page and every report show its figures. A new diagnostic needs a table in
`plateviz.tables` and a plot here.
"""

from collections.abc import Callable
from dataclasses import dataclass

from plateviz.figures.figure import Figure
from plateviz.plots.workspace import OrbitWorkspace
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.simulate.settings import SurveySettings

TO_COMPARE = "Change a setting under Refit, or choose a solution under “Compare with (A)”."
"""What to do where there is no other solution to compare with."""


@dataclass(frozen=True)
class Chosen:
    """The solution and the part of it that a diagnostic shows.

    Attributes
    ----------
    result : the solution
    instrument : that took the orbit
    exposures : shown exposures as (field_id, plate_id)
    detector : shown detector_id, or None for all
    other : solution to compare with, or None
    beside : solution whose figure stands beside this one, with arrows to the same scale, or None
    simulation : settings with which the orbit was simulated; None where they are not known
    """

    result: FitResult
    instrument: Instrument
    exposures: tuple[tuple[int, int], ...] = ()
    detector: int | None = None
    other: FitResult | None = None
    beside: FitResult | None = None
    simulation: SurveySettings | None = None


def _always(_: Chosen) -> bool:
    return True


@dataclass(frozen=True)
class Diagnostic:
    """One figure of a solution.

    Attributes
    ----------
    name : short and unique, used in addresses and file names
    title : displayed title
    caption : what it shows and what a good solution looks like, in a few sentences
    workspace : part of the Orbit page that shows the figure
    position : sort key on the page
    plot : function of a `Chosen` that returns the figure
    follows_shown : whether the figure depends on the shown exposures and detector
    is_wide : whether it takes the whole width of its workspace, or of a report
    has_data : whether there is anything to draw, such as a truth or another solution
    is_of_simulation : whether the Orbit page shows it for a simulated survey only
    needs_verdict : whether it rests on the verdict, which may follow the solution
    needs_eigenmodes : whether it shows the eigenmodes, which a what-if has once they are asked for
    is_key : whether the Verdict workspace shows it, small
    equation : what is drawn, as text
    least_height : that it needs on the page, screen pixels; 0 where any card's height is enough
    narrow_height : the same in a window narrower than 1536 pixels; 0 for `least_height`
    column_height : the same where all figures are in one column, in a window narrower than 1200
        pixels; 0 for `narrow_height`
    """

    name: str
    title: str
    caption: str
    workspace: OrbitWorkspace
    position: int
    plot: Callable[[Chosen], Figure]
    follows_shown: bool = False
    is_wide: bool = False
    has_data: Callable[[Chosen], bool] = _always
    is_of_simulation: bool = False
    needs_verdict: bool = False
    needs_eigenmodes: bool = False
    is_key: bool = False
    equation: str = ""
    least_height: int = 0
    narrow_height: int = 0
    column_height: int = 0

    @property
    def document(self) -> str:
        """Where the documents explain the figure."""
        return f"assets/docs/diagnostics.md, “{self.title}”"
