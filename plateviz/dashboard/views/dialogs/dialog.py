"""A dialog over the page, and the button that opens it."""

from collections.abc import Callable
from typing import Protocol

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.views.cards.figure import Part

# By default it has a grey of the light theme in both.
_CROSS = {"& .MuiIconButton-root[aria-label=close]": {"color": "text.primary"}}


class HasDialog(Protocol):
    """A part of the page that is a dialog."""

    def open(self) -> None:
        """Open the dialog."""

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the dialog."""
        ...


def dialog(title: str, *contents: Part, width: str) -> pmui.Dialog:
    """Return a closed dialog that Escape, its cross and a click beside it close.

    Parameters
    ----------
    width : at most, as Material UI names it: "sm", "md" or "lg"
    """
    return pmui.Dialog(
        *contents,
        title=title,
        open=False,
        show_close_button=True,
        close_on_click=True,
        width_option=width,
        sx=_CROSS,
    )


def dialog_button(label: str, make: Callable[[], HasDialog]) -> list[pn.viewable.Viewable]:
    """Return the button that opens a dialog, and the place of the dialog.

    The dialog is made when it is first opened: a page opens sooner without it.
    """
    place = pmui.Column(margin=0)
    made: list[HasDialog] = []

    def open_dialog(_: object) -> None:
        if not made:
            made.append(make())
            place.append(made[0])
        made[0].open()

    button = pmui.Button(label=label, variant="text", size="small")
    button.on_click(open_dialog)
    return [button, place]
