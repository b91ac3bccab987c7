"""NoticeView: what cannot be shown, that the run is gone, and what is to be done, in words."""

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.elements.markup import alert_words


class NoticeView(pn.viewable.Viewer):
    """Messages above the page; nothing while there is nothing to say.

    That of an address stays until it is closed, that of a run until the run is there again, and
    what is to be done until it is done.
    """

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._row = pmui.Column(margin=0, sizing_mode="stretch_width")
        session.param.watch(self._show, ["notice", "loss", "advice"])
        self._show()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the message."""
        return self._row

    def _show(self, *_: object) -> None:
        alerts = []
        if self._session.loss:
            alerts.append(_alert(self._session.loss))
        if self._session.notice:
            alerts.append(_alert(self._session.notice, closeable=True))
            alerts[-1].param.watch(self._close, "closed")
        if self._session.advice:
            alerts.append(_alert(self._session.advice, severity="info"))
        self._row[:] = alerts

    def _close(self, *_: object) -> None:
        self._session.notice = ""


def _alert(text: str, closeable: bool = False, severity: str = "warning") -> pmui.Alert:
    return pmui.Alert(
        object=alert_words(text),
        severity=severity,
        closeable=closeable,
        margin=(6, 0),
        sizing_mode="stretch_width",
    )
