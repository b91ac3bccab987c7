"""AddressBar: the browser's address and its history."""

from urllib.parse import parse_qs, urlencode

import panel as pn
import param

from plateviz.dashboard.navigation.navigation import WORKSPACES, Navigation, View
from plateviz.dashboard.session.shown_address import SHOWN
from solver.data.subset import KINDS

# Parts of an address whose change is a step of the browser's history; others replace the last one.
_STEPS = ("view", "workspace", "run", "orbit", "source")
# Another solution is a step, too, if so much time has passed since the one before: a slider that is
# dragged shows many.
_PAUSE_MILLISECONDS = 1500
_MOST_CHARACTERS, _MOST_PARTS = 20_000, 100


class AddressBar(pn.custom.JSComponent):
    """Writes what is on the screen into the browser's address, and follows back and forward.

    Panel's own component makes a step of the history of every change.
    """

    query = param.String(doc="of the address, without the question mark")
    steps = param.List(item_type=str, doc="parts whose change is a step of the history")
    pause = param.Integer(doc="ms between two solutions that are steps")
    answered = param.Integer(doc="number of the last step back or forward that has been followed")
    is_blink = param.Boolean(doc="whether two runs or solutions were exchanged, which is no step")

    _esm = """
    export function render({ model }) {
      let isFirst = true, timer = null, last = 0, asked = model.answered
      const places = search => {
        const parts = new URLSearchParams(search)
        return JSON.stringify(model.steps.map(name => parts.get(name)))
      }
      const solution = search => new URLSearchParams(search).get("solution")
      const isStepTo = search => {
        const isOther = solution(search) !== solution(location.search)
        const isPlace = places(search) !== places(location.search)
        const isLater = Date.now() - last > model.pause
        if (isOther || isPlace) last = Date.now()
        return isPlace || (isOther && isLater)
      }
      const write = () => {
        const search = `?${model.query}`
        // What was on the screen before the last step is no answer to it.
        if (model.answered < asked || !model.query || search === location.search) return
        const isStep = isStepTo(search) && !isFirst && !model.is_blink
        isFirst = false
        const url = location.pathname + search + location.hash
        history[isStep ? "pushState" : "replaceState"](history.state, "", url)
      }
      // One action changes several parts, one after the other.
      const later = () => { clearTimeout(timer); timer = setTimeout(write, 100) }
      const follow = () => {
        clearTimeout(timer)
        last = Date.now()
        asked += 1
        model.send_msg({ number: asked, query: location.search.slice(1) })
      }
      model.on("query", later)
      model.on("answered", later)
      later()
      addEventListener("popstate", follow)
      model.on("remove", () => { clearTimeout(timer); removeEventListener("popstate", follow) })
    }
    """
    _stylesheets = [":host { display: none; }"]

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow `navigation` and its session."""
        super().__init__(steps=list(_STEPS), pause=_PAUSE_MILLISECONDS, margin=0, **params)
        self._navigation = navigation
        session = navigation.session
        self._runs = navigation.run_name, session.run_comparison.other
        self._solutions = session.shown, session.other
        names = ["view", *WORKSPACES.values(), "run_name", "found"]
        navigation.param.watch(self._write, names)
        for exploration in (navigation.exploration, navigation.survey_exploration):
            exploration.param.watch(self._write, list(exploration.param.values()))
        session.param.watch(self._write, ["shown", "other", "stage", "figure_of_both"])
        session.run_comparison.param.watch(self._write, ["other", "figure"])
        session.units.param.watch(self._write, "unit")
        session.shown_part.param.watch(self._write, ["orbit", *SHOWN])
        session.selection.param.watch(self._write, [*KINDS, "kept"])
        self._is_following = False
        self._write()

    def _write(self, *_: object) -> None:
        navigation = self._navigation
        is_there = navigation.view is not View.ORBIT or navigation.session.shown is not None
        if is_there and not self._is_following:
            # As a whole: what is no longer selected is not in it.
            query = urlencode(navigation.address(), safe=",=/[]:")
            if query != self.query:
                self.param.update(is_blink=self._is_blink(), query=query)

    def _is_blink(self) -> bool:
        """Return whether what is on the screen has become the other one since the last query."""
        session = self._navigation.session
        before, other = self._runs, session.run_comparison.other
        self._runs = self._navigation.run_name, other
        if other not in ("", before[1]) and other == before[0]:
            return True
        (shown, compared), self._solutions = self._solutions, (session.shown, session.other)
        return shown is not None and session.shown is compared and session.other is shown

    def _handle_msg(self, data: object) -> None:
        """Show what the browser has gone back or forward to."""
        if not isinstance(data, dict) or not isinstance(data.get("number"), int):
            return
        query = str(data.get("query"))[:_MOST_CHARACTERS]
        try:
            parts = parse_qs(query, keep_blank_values=True, max_num_fields=_MOST_PARTS)
        except ValueError:
            parts = {}
        # What is between the two is no step of the history.
        self._is_following = True
        try:
            self._navigation.begin({name: values[0] for name, values in parts.items()})
        finally:
            self._is_following = False
            self._write()
            self.answered = data["number"]
