"""Navigation: view, run and source on the screen of one browser session, without Panel."""

import re
from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import NamedTuple

import pandas as pd
import param

from plateviz.dashboard.exploration import Exploration
from plateviz.dashboard.growth import Growth
from plateviz.dashboard.session import Session
from plateviz.plots.workspace import OrbitWorkspace, SourceWorkspace, SurveyWorkspace, Workspace
from plateviz.runs.explorable import COLUMNS_OF_RUN
from plateviz.runs.queries import SurveyRun
from plateviz.solving.origin import SurveyFolder
from plateviz.tables.explore import EXPLORABLE
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


# Each view keeps its own workspace while others are on the screen.
WORKSPACES: Mapping[View, str] = MappingProxyType(
    {
        View.SURVEY: "survey_workspace",
        View.ORBIT: "orbit_workspace",
        View.SOURCE: "source_workspace",
    }
)


class FoundSource(NamedTuple):
    """One source of a run: a row per orbit and, once the run is complete, its motion."""

    source_id: int
    history: pd.DataFrame
    motion: pd.Series | None


class Navigation(param.Parameterized):
    """What is on the screen of one browser session.

    `run_name` is None if the survey has no run. `found` is the result of the last search for a
    source of the run; if it is None, `message` says why. `exploration` and `survey_exploration` are
    what the Explore workspaces of the Orbit and the Survey view draw.
    """

    view = param.Selector(default=View.ORBIT, objects=list(View), doc="view on the screen")
    survey_workspace = param.Selector(objects=list(SurveyWorkspace), doc="of the Survey view")
    orbit_workspace = param.Selector(objects=list(OrbitWorkspace), doc="of the Orbit view")
    source_workspace = param.Selector(objects=list(SourceWorkspace), doc="of the Source view")
    run_name = param.Selector(default=None, objects=[None], doc="run of the survey")
    written = param.Parameter(default=None, doc="what the run has, see `SurveyRun.written`")
    growth = param.String(default="", doc="how far the run is; empty once it is complete")
    found = param.ClassSelector(class_=FoundSource, default=None, allow_None=True)
    message = param.String(default="", doc="why no source is shown")

    def __init__(self, session: Session) -> None:
        """Begin with the first whole run, or with the orbit while no run has been gathered."""
        super().__init__()
        self.session = session
        self.exploration = Exploration(list(EXPLORABLE))
        self.survey_exploration = Exploration(list(COLUMNS_OF_RUN))
        self._source_text = ""
        self._growth: tuple[SurveyRun, Growth] | None = None
        self._runs = {run.name: run for run in session.store.runs()}
        if self._runs:
            self.param["run_name"].objects = list(self._runs)
            whole = [name for name, run in self._runs.items() if run.is_complete]
            self.run_name = (whole or list(self._runs))[0]
            if self._runs[self.run_name].is_gathered:
                self.view = View.SURVEY
        self.look_again()
        self.param.watch(self._begin_run, "run_name")

    @property
    def workspace(self) -> Workspace:
        """The workspace on the screen."""
        return getattr(self, WORKSPACES[self.view])

    @property
    def workspaces_of_view(self) -> list[Workspace]:
        """The workspaces of the view on the screen, in page order."""
        return list(self.param[WORKSPACES[self.view]].objects)

    @property
    def run(self) -> SurveyRun | None:
        """The run on the screen; None if there is none."""
        return self._runs.get(self.run_name)

    @property
    def why_no_run(self) -> str:
        """Message on how to make a run; empty if there is one."""
        if self.run is not None:
            return ""
        origin = self.session.store.origin
        if isinstance(origin, SurveyFolder):
            return (
                "This survey has not been fitted as a whole. "
                f"`plateviz survey {origin.directory}` fits all its orbits; "
                "reload this page once it has begun."
            )
        return (
            "These are the files of one orbit. For a survey directory, `plateviz survey DIR` "
            "fits all orbits, and `plateviz serve DIR` shows them here."
        )

    def look_again(self) -> bool:
        """Look what the run on the screen has by now; return whether more may be added to it."""
        run = self.run
        if run is None:
            return False
        if self._growth is None or self._growth[0] is not run:
            self._growth = run, Growth(run.survey, run.name)
        try:
            written = run.written()
        except InputError:
            # A file is being replaced, or the run is: the next look tells.
            return True
        with param.parameterized.batch_call_watchers(self):
            self.growth = self._growth[1].look(written)
            if written != self.written:
                self.written = written
                self._look()
        return bool(self.growth)

    def begin(self, address: Mapping[str, str]) -> None:
        """Show what a page's address requests; invalid values are ignored.

        Parameters
        ----------
        address : query of the address, as from `address`; a selection without a view opens the
            Orbit view
        """
        self.session.selection.restore(address)
        is_survey = address.get("view") == View.SURVEY.value
        (self.survey_exploration if is_survey else self.exploration).restore(address)
        views = {view.value: view for view in View}
        if address.get("run") in self._runs:
            self.run_name = address["run"]
        if "source" in address:
            self.find_source(address["source"])
        selectable = self.session.selection.param.values()
        default = View.ORBIT if any(name in selectable for name in address) else self.view
        self.turn_to(views.get(address.get("view", ""), default))
        known = {workspace.value: workspace for workspace in self.workspaces_of_view}
        self.turn_to_workspace(known.get(address.get("workspace", ""), self.workspace))

    def address(self) -> dict[str, str]:
        """Return what is on the screen as the query of the page's address."""
        query = {"view": self.view.value, "workspace": self.workspace.value}
        query |= self.session.selection.address()
        if self.run_name is not None:
            query["run"] = self.run_name
        if self.found is not None:
            query["source"] = str(self.found.source_id)
        if self.workspace is OrbitWorkspace.EXPLORE:
            query |= self.exploration.address()
        if self.workspace is SurveyWorkspace.EXPLORE:
            query |= self.survey_exploration.address()
        return query

    def turn_to(self, view: View) -> None:
        """Show a view; the Orbit view requests its orbit when it is first shown."""
        self.view = view
        session = self.session
        if view is View.ORBIT and session.shown is None and session.job is None:
            self.choose_orbit(session.selection.orbit)

    def turn_to_workspace(self, workspace: Workspace) -> None:
        """Show a workspace of the view on the screen."""
        self.param.update({WORKSPACES[self.view]: workspace})

    def choose_orbit(self, orbit: int | None) -> None:
        """Show an orbit with the settings on the screen, from the run if it has that solution."""
        shown = self.session.shown
        self._show_orbit(orbit, shown.settings if shown else None)

    def open_orbit(self, orbit: int) -> None:
        """Open the solution of an orbit in the run; fit the orbit if the run has none."""
        self._show_orbit(orbit, None)
        self.view = View.ORBIT

    def find_source(self, text: str) -> None:
        """Search the run for a source by its id as text."""
        self._source_text = text.strip()
        self._look()

    def open_source(self, text: str) -> None:
        """Search for a source, and show the Source view."""
        with param.parameterized.batch_call_watchers(self):
            self.find_source(text)
            self.view = View.SOURCE

    def _show_orbit(self, orbit: int | None, settings: FitSettings | None) -> None:
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
        """Return the solution of an orbit in the run, None if it has none."""
        if self.run is None or orbit is None or not self.run.has_fitted(orbit):
            return None
        return self.run.result(orbit)

    def _begin_run(self, *_: object) -> None:
        self.written = None
        self.look_again()

    def _look(self) -> None:
        found, message = None, ""
        if self.run is not None and self._source_text:
            try:
                found, message = _find(self.run, self._source_text)
            except InputError as error:
                message = str(error)
        self.param.update(found=found, message=message)


def _find(run: SurveyRun, text: str) -> tuple[FoundSource | None, str]:
    """Return a source of a run, or a message on why there is none."""
    if not _ID.fullmatch(text) or abs(int(text)) > _LARGEST_ID:
        return None, f"Expected the id of a source, a whole number, found {text[:40]!r}."
    source_id = int(text)
    history = run.history(source_id)
    if history.empty:
        return None, f"Run {run.name!r} has no source {source_id}."
    return FoundSource(source_id, history, run.motion(source_id)), ""
