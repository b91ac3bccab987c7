"""RemediesView: the causes of a solution's flaws, each with a button that tries what to do."""

from functools import partial
from html import escape

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.remedies import Remedy, remedies, try_settings
from plateviz.dashboard.session import Session
from plateviz.dashboard.views.markup import markup_pane, themed
from plateviz.tables.causes import Cause
from plateviz.tables.verdict import orbit_verdict
from solver.data.settings import FitSettings

# The most likely causes, and the first of many options; the reasons of the verdict have all.
_MOST, _MOST_OPTIONS = 4, 3
_GRID = {
    "display": "grid",
    "gridTemplateColumns": "repeat(auto-fit, minmax(min(100%, 560px), 1fr))",
    "gap": "6px",
}
_ROW = {"display": "grid", "gridTemplateColumns": "auto minmax(0, 1fr)", "alignItems": "center"}


class RemediesView(pn.viewable.Viewer):
    """A row for each cause; hidden while there is none, and until the solution is judged."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._rows = pmui.FlexBox(sx=_GRID, sizing_mode="stretch_width", margin=0)
        self._session.param.watch(self._fill, ["shown", "theme"])
        self._session.judging.param.watch(self._fill, "is_pending")
        self._session.units.param.watch(self._fill, "unit")
        self._fill()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the rows."""
        return self._rows

    def _fill(self, *_: object) -> None:
        shown, judge = self._session.shown, self._session.store.judge
        found: list[Remedy] = []
        if shown is not None and judge.has_judged(shown.result):
            found = remedies(shown.settings, orbit_verdict(shown.result).causes[:_MOST])
        self._rows[:] = [self._row(remedy) for remedy in found]
        self._rows.visible = bool(found)

    def _row(self, remedy: Remedy) -> pn.viewable.Viewable:
        words = markup_pane()
        words.object = themed(self._session.units.text(_words(remedy.cause)), self._session.theme)
        parts: list[pn.viewable.Viewable] = []
        if remedy.settings is not None:
            button = pmui.Button(
                label="Try it",
                description=f"Try it: solve the orbit with {_options(remedy.cause)}.",
                variant="outlined",
                size="small",
                margin=(0, 8, 0, 0),
            )
            button.on_click(partial(self._try, remedy.settings))
            parts.append(button)
        grid = _ROW if parts else {}
        return pmui.FlexBox(*parts, words, sx=grid, sizing_mode="stretch_width", margin=0)

    def _try(self, settings: FitSettings, _: object) -> None:
        try_settings(self._session, settings)


def _words(cause: Cause) -> str:
    title = f"{cause.title[0].upper()}{cause.title[1:]}"
    options = f" <code>{escape(_options(cause))}</code>" if cause.options else ""
    action = f"{cause.action[0].upper()}{cause.action[1:]}"
    return (
        f"<p class='cause'><b>{escape(title)}</b>, {cause.significance:.0f} sigma. "
        f"{escape(action)}.{options}<br><span>{escape(cause.spoils)}</span></p>"
    )


def _options(cause: Cause) -> str:
    n_more = len(cause.options) - _MOST_OPTIONS
    return " ".join(cause.options[:_MOST_OPTIONS]) + (f" and {n_more} more" if n_more > 0 else "")
