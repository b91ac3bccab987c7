"""SelectedSources: the selection of a session, and what it does to the next fit, without Panel."""

from dataclasses import replace

import param

from plateviz.dashboard.solution import Solution
from plateviz.dashboard.stage import Stage
from plateviz.dashboard.state import FitChoices, Selection
from solver.errors import InputError


class SelectedSources(param.Parameterized):
    """The selected sources in the orbit on the screen, and those left out of the next fit.

    Attributes
    ----------
    stage, message : state of the last request
    selection : what every view shows
    choices : settings of the next fit
    """

    shown = param.ClassSelector(class_=Solution, default=None, allow_None=True)
    stage = param.ClassSelector(class_=Stage, default=Stage.LOADING)
    message = param.String(default="")

    def __init__(self) -> None:
        """Begin without a selection, with the paper's settings."""
        super().__init__()
        self.selection = Selection()
        self.choices = FitChoices()

    def refuse(self, message: str) -> None:
        """Show why a request failed; the last solution stays."""
        self.param.update(stage=Stage.FAILED, message=message)

    def select_sources(self, sources: frozenset[int]) -> None:
        """Select sources by their ids, in place of those selected before."""
        self.selection.sources = sources

    def subject(self) -> str:
        """Return the orbit on the screen as it is named in files, such as "orbit-3"."""
        return f"orbit-{self.selection.orbit}"

    @property
    def selected_ids(self) -> frozenset[str]:
        """The selected sources as tables of figures name them."""
        return frozenset(map(str, self.selection.sources))

    @property
    def selected_in_orbit(self) -> frozenset[int]:
        """The selected sources among those that the orbit on the screen has measured."""
        return self.selection.sources & self._measured

    @property
    def is_selection_left_out(self) -> bool:
        """Whether the next fit uses none of the selected sources, though some are measured."""
        selected = self.selected_in_orbit
        return bool(selected) and selected <= self._left_out

    def invert_selection(self) -> None:
        """Select the other sources of the orbit on the screen."""
        self.selection.sources = self._measured - self.selection.sources

    def leave_out_selection(self) -> None:
        """Exclude the selected sources from the next fit, which shows a what-if."""
        if not self.selected_in_orbit:
            self.refuse("The orbit on the screen has measured none of the selected sources.")
            return
        self._exclude(self._left_out | self.selected_in_orbit)

    def put_back_selection(self) -> None:
        """Include the selected sources in the next fit, which shows a what-if."""
        self._exclude(self._left_out - self.selection.sources)

    @property
    def _measured(self) -> frozenset[int]:
        """Sources of the orbit on the screen, those among them that are left out."""
        if self.shown is None:
            return frozenset()
        excluded = self.shown.settings.exclusions.sources
        return excluded.union(self.shown.result.sources["source_id"].tolist())

    @property
    def _left_out(self) -> frozenset[int]:
        try:
            return self.choices.settings().exclusions.sources
        except InputError:
            return frozenset()

    def _exclude(self, sources: frozenset[int]) -> None:
        try:
            settings = self.choices.settings()
        except InputError as error:
            # Other settings than exclusions may be invalid; nothing is changed for them.
            self.refuse(str(error))
            return
        self.choices.load(settings.with_(exclusions=replace(settings.exclusions, sources=sources)))
