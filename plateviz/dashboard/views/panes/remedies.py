"""RemediesView: the causes of a solution's flaws, each with a button that tries what to do."""

from html import escape

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.session.remedies import Remedy, remedies, try_settings
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.elements.markup import markup_pane, themed
from plateviz.verdict.causes import Cause
from plateviz.verdict.verdict import orbit_verdict

# The most likely causes, and the first of many options; the reasons of the verdict have all.
_MOST, _MOST_OPTIONS = 4, 3
_GRID = {
    "display": "grid",
    "gridTemplateColumns": "repeat(auto-fit, minmax(min(100%, 560px), 1fr))",
    "gap": "6px",
}
_ROW = {"display": "flex", "flexWrap": "nowrap", "alignItems": "center"}


class RemediesView(pn.viewable.Viewer):
    """A row for each cause; hidden while there is none.

    While another solution of the same orbit is being judged, the rows of the last one stay, faded:
    if they went, the figures below would change their size twice at each step of a slider.
    """

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._orbit: int | None = None
        self._rows: list[_Row] = []
        self._box = pmui.FlexBox(sx=_GRID, sizing_mode="stretch_width", margin=0)
        self._session.param.watch(self._fill, ["shown", "theme"])
        self._session.judging.param.watch(self._fill, "is_pending")
        self._session.units.param.watch(self._fill, "unit")
        self._fill()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the rows."""
        return self._box

    def _fill(self, *_: object) -> None:
        shown, judge = self._session.shown, self._session.store.judge
        is_judged = shown is not None and judge.has_judged(shown.result)
        if shown is not None and not is_judged and shown.orbit == self._orbit:
            for row in self._rows:
                row.fade()
            return
        found: list[Remedy] = []
        if shown is not None and is_judged:
            found = remedies(shown.settings, orbit_verdict(shown.result).causes[:_MOST])
        self._orbit = shown.orbit if shown is not None and is_judged else None
        # Rows that are there take new words: the browser builds those of new ones slowly.
        more = [_Row(self._session) for _ in found[len(self._rows) :]]
        rows = [*self._rows, *more][: len(found)]
        for row, remedy in zip(rows, found, strict=True):
            row.show(remedy)
        if rows != self._rows:
            self._rows = rows
            self._box[:] = [row.box for row in rows]
        self._box.visible = bool(found)


class _Row:
    """A cause in words, and a button if there is something to try."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._remedy: Remedy | None = None
        self._words = markup_pane()
        self._button = pmui.Button(
            label="Try it", variant="outlined", size="small", margin=(0, 8, 0, 0)
        )
        self._button.on_click(self._try)
        self.box = pmui.FlexBox(
            self._button, self._words, sx=_ROW, sizing_mode="stretch_width", margin=0
        )

    def show(self, remedy: Remedy) -> None:
        """Show a cause; its remedy is tried when the button is pressed."""
        self._remedy = remedy
        self._button.param.update(
            description=_what_it_does(remedy.cause),
            visible=remedy.settings is not None,
            disabled=False,
        )
        self._write(remedy.cause, "")

    def fade(self) -> None:
        """Show that another solution is being judged, which may have other flaws."""
        self._button.disabled = True
        if self._remedy is not None:
            self._write(self._remedy.cause, "stale")

    def _write(self, cause: Cause, css_class: str) -> None:
        words = f"<div class='{css_class}'>{self._session.units.text(_words(cause))}</div>"
        self._words.object = themed(words, self._session.theme)

    def _try(self, _: object) -> None:
        if self._remedy is not None and self._remedy.settings is not None:
            try_settings(self._session, self._remedy.settings)


def _words(cause: Cause) -> str:
    options = "".join(f" <code>{escape(one)}</code>" for one in cause.options[:_MOST_OPTIONS])
    action = f"{cause.action[0].upper()}{cause.action[1:]}"
    # All of it is in the verdict above.
    evidence = f"{cause.words.partition('. ')[0].rstrip('.')}."
    return (
        f"<p class='cause'><b>{escape(cause.heading())}</b>{cause.strength()}. "
        f"{escape(action)}.{options}{_and_more(cause)}<br>"
        f"<span>{escape(evidence)} {escape(cause.spoils)}</span></p>"
    )


def _what_it_does(cause: Cause) -> str:
    return (
        f"Try it: solve the orbit with {_options(cause)}. The page shows that solution and its "
        "verdict, and the controls of the refit follow; no file is changed."
    )


def _options(cause: Cause) -> str:
    return " ".join(cause.options[:_MOST_OPTIONS]) + _and_more(cause)


def _and_more(cause: Cause) -> str:
    n_more = len(cause.options) - _MOST_OPTIONS
    return f" and {n_more} more" if n_more > 0 else ""
