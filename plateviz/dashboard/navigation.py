"""Navigation: the view that one person looks at, of which run and which source. No Panel here."""

import re
from collections.abc import Mapping
from enum import StrEnum
from typing import NamedTuple

import pandas as pd
import param

from plateviz.dashboard.session import Session
from plateviz.runs.queries import SurveyRun
from plateviz.solving.origin import SurveyFolder
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import InputError

_ID = re.compile(r"-?[0-9]{1,19}")
_LARGEST_ID = 2**63 - 1


class View(StrEnum):
    """The views of the page, from the widest to the narrowest."""

    SURVEY = "survey"
    ORBIT = "orbit"
    SOURCE = "source"


class FoundSource(NamedTuple):
    """One source as a run has it: its rows orbit by orbit and, once gathered, its motion."""

    source_id: int
    history: pd.DataFrame
    motion: pd.Series | None


class Navigation(param.Parameterized):
    """What is on the screen of one browser session.

    `run_name` is None where the survey has no run. `found` is the source that was last looked for
    in the run; where there is none, `message` says why.
    """

    view = param.Selector(default=View.ORBIT, objects=list(View), doc="view on the screen")
    run_name = param.Selector(default=None, objects=[None], doc="run of the survey")
    found = param.ClassSelector(class_=FoundSource, default=None, allow_None=True)
    message = param.String(default="", doc="why no source is shown")

    def __init__(self, session: Session) -> None:
        """Begin with the first whole run, or with the orbit while no run has been gathered."""
        super().__init__()
        self.session = session
        self._sought = ""
        self._runs = {run.name: run for run in session.store.runs()}
        if self._runs:
            self.param["run_name"].objects = list(self._runs)
            whole = [name for name, run in self._runs.items() if run.is_complete]
            self.run_name = (whole or list(self._runs))[0]
            if self._runs[self.run_name].is_gathered:
                self.view = View.SURVEY
        self.param.watch(lambda *_: self._look(), "run_name")

    @property
    def run(self) -> SurveyRun | None:
        """The run that is shown; None where there is none."""
        return self._runs.get(self.run_name)

    @property
    def why_no_run(self) -> str:
        """What to do for a run; empty where there is one."""
        if self.run is not None:
            return ""
        origin = self.session.store.origin
        if isinstance(origin, SurveyFolder):
            return (
                "This survey has not been fitted as a whole. "
                f"`plateviz survey {origin.directory}` fits all its orbits; "
                "then load this page anew."
            )
        return (
            "These are the files of one orbit. Many orbits are a survey directory: "
            "`plateviz survey DIR` fits them all, and `plateviz serve DIR` shows them here."
        )

    def begin(self, address: Mapping[str, str]) -> None:
        """Turn to what a page's address asks for; what is not there is not looked at.

        Parameters
        ----------
        address : as from `address`; one with a selection alone is of the Orbit view
        """
        self.session.selection.want(address)
        views = {view.value: view for view in View}
        if address.get("run") in self._runs:
            self.run_name = address["run"]
        if "source" in address:
            self.find_source(address["source"])
        of_orbit = self.session.selection.param.values()
        selected = View.ORBIT if any(name in of_orbit for name in address) else self.view
        self.turn_to(views.get(address.get("view", ""), selected))

    def address(self) -> dict[str, str]:
        """Return what is on the screen as words for the page's address."""
        words = {"view": self.view.value, **self.session.selection.address()}
        if self.run_name is not None:
            words["run"] = self.run_name
        if self.found is not None:
            words["source"] = str(self.found.source_id)
        return words

    def turn_to(self, view: View) -> None:
        """Put a view on the screen; the Orbit view asks for its orbit when it is first seen."""
        self.view = view
        session = self.session
        if view is View.ORBIT and session.shown is None and session.job is None:
            self.choose_orbit(session.selection.orbit)

    def choose_orbit(self, orbit: int | None) -> None:
        """Turn to an orbit with the settings on the screen; what the run has is not made again."""
        shown = self.session.shown
        self._turn_to_orbit(orbit, shown.settings if shown else None)

    def open_orbit(self, orbit: int) -> None:
        """Open an orbit as the run has it; one that the run has not is fitted."""
        self._turn_to_orbit(orbit, None)
        self.view = View.ORBIT

    def find_source(self, text: str) -> None:
        """Look for a source of the run by its id as text."""
        self._sought = text.strip()
        self._look()

    def open_source(self, text: str) -> None:
        """Look for a source, and turn to it."""
        with param.parameterized.batch_call_watchers(self):
            self.find_source(text)
            self.view = View.SOURCE

    def _turn_to_orbit(self, orbit: int | None, settings: FitSettings | None) -> None:
        try:
            result = self._result(orbit)
        except InputError as error:
            self.session.refuse(str(error))
            return
        if result is None or settings not in (None, result.settings):
            self.session.show_orbit(orbit)
        else:
            self.session.show_result(orbit, result)

    def _result(self, orbit: int | None) -> FitResult | None:
        """Return an orbit as the run has it, None where it has not."""
        if self.run is None or orbit is None or not self.run.has_fitted(orbit):
            return None
        return self.run.result(orbit)

    def _look(self) -> None:
        found, message = None, ""
        if self.run is not None and self._sought:
            found, message = _found(self.run, self._sought)
        self.param.update(found=found, message=message)


def _found(run: SurveyRun, sought: str) -> tuple[FoundSource | None, str]:
    """Return a source of a run, or why there is none."""
    if not _ID.fullmatch(sought) or abs(int(sought)) > _LARGEST_ID:
        return None, f"Expected the id of a source, a whole number, found {sought[:40]!r}."
    source_id = int(sought)
    history = run.history(source_id)
    if history.empty:
        return None, f"Run {run.name!r} has no source {source_id}."
    return FoundSource(source_id, history, run.motion(source_id)), ""
