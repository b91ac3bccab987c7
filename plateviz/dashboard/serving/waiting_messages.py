"""Waiting messages: those to a page that Panel would send only with the next one.

While Panel sends messages, later ones wait. It may forget that they do: if one is added between the
arrival of the last and the moment when Panel notes it, it waits until something else on the page
changes, and what the page shows is out of date until then.
"""

from functools import wraps
from typing import Any

from bokeh.document import Document
from panel.io import document as panel_document

# They have no public names. A test, run with the newest Panel too, notices a change.
_PANEL: Any = panel_document


def send_waiting_messages() -> None:
    """Let Panel send each message of this process for which it has scheduled the sending."""
    send = _PANEL._dispatch_msgs  # noqa: SLF001
    if hasattr(send, "__wrapped__"):
        return

    @wraps(send)
    async def send_all(document: Document) -> None:
        # Panel goes by this, and removes it when earlier messages have been sent.
        _PANEL._WRITE_BLOCK[document] = True  # noqa: SLF001
        await send(document)

    _PANEL._dispatch_msgs = send_all  # noqa: SLF001
