"""NoticeView: what of an address, or of a saved view, cannot be shown."""

from html import escape

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.session import Session


class NoticeView(pn.viewable.Viewer):
    """One message above the page until it is closed; nothing while there is nothing to say."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._row = pmui.Column(margin=0, sizing_mode="stretch_width")
        session.param.watch(self._show, "notice")
        self._show()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the message."""
        return self._row

    def _show(self, *_: object) -> None:
        if not self._session.notice:
            self._row.clear()
            return
        alert = pmui.Alert(
            # It is taken for Markdown, in which HTML would be kept.
            object=escape(self._session.notice),
            severity="warning",
            closeable=True,
            margin=(6, 0),
            sizing_mode="stretch_width",
        )
        alert.param.watch(self._close, "closed")
        self._row[:] = [alert]

    def _close(self, *_: object) -> None:
        self._session.notice = ""
