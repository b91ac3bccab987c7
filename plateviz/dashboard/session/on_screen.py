"""SolutionsOnScreen: the solution that a session shows, and the one it is compared with."""

from collections.abc import Mapping

import param

from plateviz.dashboard.address_parts import chosen
from plateviz.dashboard.session.run_comparison import RunComparison
from plateviz.dashboard.session.solution import Request, Solution
from plateviz.dashboard.session.stage import RequestState, Stage
from plateviz.plots.comparison.both_solutions import comparable_figures


class SolutionsOnScreen(RequestState):
    """The solutions on the screen of one browser session.

    `shown` is the solution on the screen, `other` the one that it is compared with; either may
    be None. `solutions` are those of its orbit. `run_comparison` is what is compared of two runs.
    """

    shown = param.ClassSelector(class_=Solution, default=None, allow_None=True)
    other = param.ClassSelector(class_=Solution, default=None, allow_None=True)
    figure_of_both = param.String(default="residual-map", doc="name of what is drawn of both")
    solutions = param.List(default=[], item_type=Solution)

    def __init__(self) -> None:
        """Begin without a solution."""
        super().__init__()
        self._fitted: Solution | None = None
        # What a person has chosen to compare all solutions with, in place of the one before each.
        self.chosen_other: Solution | None = None
        # What was opened last, which may still be computed.
        self.coming: Solution | Request | None = None
        self.run_comparison = RunComparison()

    @property
    def fitted(self) -> Solution | None:
        """The solution on the screen, or the one before the what-ifs on the screen."""
        return self._fitted if self.shown is not None and self.shown.is_replaceable else self.shown

    def awaited_of(self, orbit: int | None, is_opening: bool) -> Solution | Request | None:
        """Return the solution of an orbit that is on its way to the screen; None if none is.

        Parameters
        ----------
        is_opening : whether one is on its way to where another one of the same orbit is
        """
        is_there = self.shown is not None and self.shown.orbit == orbit
        is_awaited = self.coming is not None and self.coming.orbit == orbit
        return self.coming if is_awaited and (is_opening or not is_there) else None

    def restore_both(self, address: Mapping[str, str]) -> list[str]:
        """Draw of both solutions what an address requests; return what is invalid, in words."""
        problems: list[str] = []
        names = [one.name for one in comparable_figures()]
        both = chosen("both", address, names, self.figure_of_both, problems)
        self.figure_of_both = both
        return problems

    def compare_with(self, solution: Solution | None) -> None:
        """Compare what is on the screen with a solution; None for the one before each.

        Parameters
        ----------
        solution : may be of another run or orbit
        """
        self.chosen_other = solution
        if self.shown is not None:
            self.other = self._beside(self.shown, self.fitted)

    def _beside(self, solution: Solution, before: Solution | None) -> Solution | None:
        """Return what a solution is compared with, given the one before it of the same orbit."""
        if self.chosen_other is not None:
            return None if self.chosen_other.equals(solution) else self.chosen_other
        return None if before is None or before.settings == solution.settings else before

    def _return_to(self, solution: Solution) -> None:
        """Return from a what-if to a listed solution, alone if the what-if was compared with it."""
        if solution is not self.shown:
            other = self._beside(solution, self.fitted)
            self.param.update(shown=solution, other=other, stage=Stage.READY, message="")
