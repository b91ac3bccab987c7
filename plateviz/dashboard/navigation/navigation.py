"""Navigation: view, run and source on the screen of one browser session, without Panel."""

from collections.abc import Mapping

import param

from plateviz.dashboard.address_parts import chosen, unknown_parts
from plateviz.dashboard.navigation.exploration import PARTS, Exploration
from plateviz.dashboard.navigation.found_source import FoundSource, find_source
from plateviz.dashboard.navigation.growth import Growth, how_to_make_a_run
from plateviz.dashboard.navigation.known_runs import KnownRuns
from plateviz.dashboard.navigation.next_orbit import NextOrbit
from plateviz.dashboard.navigation.view import WORKSPACES, View
from plateviz.dashboard.session.run_comparison import OF_RUNS
from plateviz.dashboard.session.selection_actions import look_for_kept
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.shown_address import SHOWN
from plateviz.dashboard.session.solution import Request, Solution
from plateviz.dashboard.session.solution_address import find_solution, solution_query
from plateviz.dashboard.session.units import NAMES, OWN
from plateviz.plots.workspace import OrbitWorkspace, SourceWorkspace, SurveyWorkspace, Workspace
from plateviz.runs.explorable import COLUMNS_OF_RUN
from plateviz.runs.run import Run
from plateviz.tables.explore import EXPLORABLE
from solver.data.subset import KINDS
from solver.errors import InputError

# Parts of an address that name solutions.
_NAMED = ("solution", "against")
_KNOWN = (
    *("view", "workspace", "orbit", "run", "source", "unit", "both", "selection"),
    *(*SHOWN, *KINDS, *PARTS, *_NAMED, *OF_RUNS),
)


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
    run_progress = param.Parameter(default=None, doc="what the run has, see `Run.progress`")
    growth = param.String(default="", doc="how far the run is; empty once it is complete")
    found = param.ClassSelector(class_=FoundSource, default=None, allow_None=True)
    message = param.String(default="", doc="why no source is shown")

    def __init__(self, session: Session) -> None:
        """Begin with the first whole run, or with the orbit while no run has been gathered."""
        super().__init__()
        self.session = session
        self.exploration = Exploration(list(EXPLORABLE))
        self.survey_exploration = Exploration(list(COLUMNS_OF_RUN))
        self._source_text, self._next_orbit = "", NextOrbit()
        self._named: dict[str, str] = {}
        self._of_address: object = None
        self._growth: tuple[Run, Growth] | None = None
        runs = self.known_runs = KnownRuns(session.store)
        if runs.first is not None:
            self.param["run_name"].objects = list(runs)
            self.run_name = runs.first.name
            if runs.first.is_gathered:
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
    def run(self) -> Run | None:
        """The run on the screen; None if there is none."""
        return self.known_runs.get(self.run_name)

    @property
    def runs(self) -> list[Run]:
        """The runs of the survey, by name."""
        return list(self.known_runs.values())

    @property
    def why_no_run(self) -> str:
        """Message on how to make a run; empty if there is one."""
        return how_to_make_a_run(self.session.store.origin) if self.run is None else ""

    def look_again(self) -> bool:
        """Look what the run on the screen has by now; return whether more may be added to it."""
        run = self.run
        if run is None:
            return False
        if self._growth is None or self._growth[0] is not run:
            self._growth = run, Growth(run.survey, run.name)
        try:
            progress = run.progress()
        except InputError as error:  # While a file is replaced, or the run: the next look tells.
            self.message = str(error) if self.run_progress is None else self.message
            return True
        with param.parameterized.batch_call_watchers(self):
            self.growth = self._growth[1].look(progress)
            if progress != self.run_progress:
                self.run_progress = progress
                self.session.shown_part.offer_orbits(self.session.store.orbits)
                self._search_again()
        return bool(self.growth)

    def begin(self, address: Mapping[str, str]) -> None:
        """Show what an address requests; a notice says what of it is invalid or gone.

        Parameters
        ----------
        address : query of the address, as from `address`; a selection without a view opens the
            Orbit view
        """
        session, problems = self.session, []
        session.notice = ""
        # Half a character, which JSON can hold, is no part of an address.
        address = {k: v.encode("utf-8", "replace").decode() for k, v in address.items()}
        problems += unknown_parts(address, _KNOWN)
        is_survey = address.get("view") == View.SURVEY.value
        explored = self.survey_exploration if is_survey else self.exploration
        problems += explored.restore(address) + session.restore_both(address)
        units = session.units
        units.unit = chosen("unit", address, NAMES.values(), units.unit, problems)
        self.run_name = chosen("run", address, self.known_runs, self.run_name, problems)
        problems += session.run_comparison.restore(address, self.run_name, self.known_runs)
        if "source" in address:
            self.find_source(address["source"])
        if "selection" in address:
            # Somebody else may have kept it.
            look_for_kept(session)
        problems += session.shown_part.restore(address) + session.selection.restore(address)
        try:
            orbit = session.shown_part.orbit_of(address)
        except InputError as error:
            problems.append(str(error))
            orbit = session.shown_part.orbit
        default = View.ORBIT if {*address} & {"orbit", *SHOWN, *KINDS} else self.view
        view = View(chosen("view", address, [v.value for v in View], default.value, problems))
        session.note(problems)
        self._named = {name: address[name] for name in _NAMED if name in address}
        if view is View.ORBIT or session.shown is not None:
            self._open(orbit)
        else:
            session.shown_part.orbit = orbit
        self.view = view
        self._begin_workspace(address)

    def address(self, is_whole: bool = False) -> dict[str, str]:
        """Return what is on the screen as the query of the page's address.

        Parameters
        ----------
        is_whole : whether settings that are too long for an address are written, too
        """
        query = {"view": self.view.value, "workspace": self.workspace.value}
        query |= self.session.shown_part.address() | self.session.selection.address()
        if self.run_name is not None:
            query["run"] = self.run_name
        if self.found is not None:
            query["source"] = str(self.found.source_id)
        if self.session.units.unit != OWN:
            query["unit"] = self.session.units.unit
        if self.workspace is OrbitWorkspace.ORDERS:
            query["both"] = self.session.figure_of_both
        if self.workspace is OrbitWorkspace.EXPLORE:
            query |= self.exploration.address()
        if self.workspace is SurveyWorkspace.EXPLORE:
            query |= self.survey_exploration.address()
        if self.workspace is SurveyWorkspace.COMPARE:
            query |= self.session.run_comparison.address(self.run_name, self.known_runs)
        return query | self._solution_query(is_whole)

    def _solution_query(self, is_whole: bool = False) -> dict[str, str]:
        session, coming = self.session, self.session.coming
        if session.shown is None or (session.is_opening and coming is self._of_address):
            return self._named
        shown = session.awaited_of(session.shown_part.orbit, session.is_opening) or session.shown
        large = None if is_whole else session.selection.large
        return solution_query(shown, session.other, self.run_name, large)

    def turn_to(self, view: View) -> None:
        """Show a view; the Orbit view requests its orbit when it is first shown."""
        session, self.view = self.session, view
        if view is View.ORBIT and session.shown is None and session.job is None:
            self._open(session.shown_part.orbit)

    def turn_to_workspace(self, workspace: Workspace) -> None:
        """Show a workspace of the view on the screen."""
        self.param.update({WORKSPACES[self.view]: workspace})

    def choose_orbit(self, orbit: int | None) -> None:
        """Show an orbit with the settings on the screen; before a what-if, what it changes."""
        self._show_orbit(orbit, self.session.shown)

    def open_orbit(self, orbit: int) -> None:
        """Open the solution of an orbit in the run; fit the orbit if the run has none."""
        self._show_orbit(orbit, None)
        self.view = View.ORBIT

    def expect_orbit(self) -> None:
        """Let the orbit of the run be read ahead that is likely to be asked for next."""
        # Of a what-if, the one that it changes.
        part, shown = self.session.shown_part, self.session.fitted
        run = self.known_runs.get(shown.run) if shown is not None else None
        if run is not None:
            run.expect(self._next_orbit.after(part.orbit, part.param["orbit"].objects))

    def find_source(self, text: str) -> None:
        """Search the run for a source by its id as text."""
        self._source_text = text.strip()
        self._search_again()

    def open_source(self, text: str) -> None:
        """Search for a source, and show the Source view."""
        with param.parameterized.batch_call_watchers(self):
            self.find_source(text)
            self.view = View.SOURCE

    def _show_orbit(self, orbit: int | None, last: Solution | None) -> None:
        session = self.session
        try:
            found = self._solution(None, orbit)
        except InputError as error:
            session.refuse(str(error))
            return
        is_there = isinstance(found, Solution)
        if is_there and (last is None or last.settings == found.settings):
            session.show_result(found)
        elif is_there and last is not None and last.is_replaceable:
            session.open(Request(orbit, last.settings, is_what_if=True), found)
        else:
            session.show_orbit(orbit)

    def _open(self, orbit: int | None) -> None:
        """Show the solution that the address names."""
        session, shown = self.session, self.session.shown
        is_there = shown is not None and shown.orbit == session.shown_part.orbit == orbit
        if is_there and self._solution_query() == self._named:
            session.limit_shown_part()
            return
        try:
            solution = self._find("solution", orbit) or self._solution(None, orbit)
            other = self._find("against", orbit)
            if other is None and isinstance(solution, Request) and solution.is_what_if:
                # It is a change of that solution, to which the controls lead back.
                other = self._solution(None, orbit)
        except InputError as error:
            session.shown_part.orbit = orbit
            session.refuse(str(error))
            return
        self._of_address = solution
        session.open(solution, other)

    def _solution(self, text: str | None, orbit: int | None) -> Solution | Request:
        """Return the solution of a text, None for that of the run; InputError if unreadable."""
        kept, large = self.session.store.kept, self.session.selection.large
        return find_solution(text, orbit, self.run, self.known_runs, kept, large)

    def _find(self, name: str, orbit: int | None) -> Solution | Request | None:
        """Return a solution that the address names; a notice says why there is none."""
        if name not in self._named:
            return None
        try:
            return self._solution(self._named[name], orbit)
        except InputError as error:
            self.session.note([f"{name}: {error}"])
            return None

    def _begin_workspace(self, address: Mapping[str, str]) -> None:
        problems: list[str] = []
        known = {workspace.value: workspace for workspace in self.workspaces_of_view}
        name = chosen("workspace", address, known, self.workspace.value, problems)
        self.turn_to_workspace(known[name])
        self.session.note(problems)

    def _begin_run(self, *_: object) -> None:
        # Nothing of the run before is shown under the name of this one, even if it is unreadable.
        self.param.update(run_progress=None, growth="", found=None, message="")
        self.look_again()

    def _search_again(self) -> None:
        found, message = None, ""
        if self.run is not None and self._source_text:
            try:
                found, message = find_source(self.run, self._source_text)
            except InputError as error:
                message = str(error)
        self.param.update(found=found, message=message)
