"""CodeWindow: a window with the code that makes the solution on the screen."""

from html import escape

import panel as pn

from plateviz.dashboard.session import Session
from plateviz.dashboard.views.markup import markup_pane, themed
from plateviz.dashboard.views.window import window
from plateviz.solving.as_code import as_command, as_python

_ABOUT = "These make the solution on the screen again: {}. A click selects the whole text."
_OF_WHAT_IF = " It is a what-if; a fit agrees with it to a thousandth of each uncertainty."


class CodeWindow(pn.viewable.Viewer):
    """The command line and the Python that make the solution on the screen."""

    def __init__(self, session: Session, **params: object) -> None:
        """Begin closed."""
        super().__init__(**params)
        self._session, self._text = session, markup_pane()
        self._window = window("Reproduce", self._text, width="md")
        session.param.watch(self._follow, ["shown", "theme"])

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the window."""
        return self._window

    def open(self) -> None:
        """Open the window."""
        self._window.open = True
        self._follow()

    def _follow(self, *_: object) -> None:
        shown, origin = self._session.shown, self._session.store.origin
        if shown is None or not self._window.open:
            return
        parts = {
            "Command line": as_command(origin, shown.orbit, shown.settings),
            "Python": as_python(origin, shown.orbit, shown.settings),
        }
        blocks = "".join(
            f"<h3>{title}</h3><pre>{escape(code)}</pre>" for title, code in parts.items()
        )
        about = _ABOUT.format(shown.settings.describe())
        text = escape(about + (_OF_WHAT_IF if shown.is_what_if else ""))
        markup = f"<div class='code'><p>{text}</p>{blocks}</div>"
        self._text.object = themed(markup, self._session.theme)
