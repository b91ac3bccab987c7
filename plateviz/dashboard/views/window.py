"""A window over the page."""

import panel_material_ui as pmui

from plateviz.dashboard.views.figure import Part


def window(title: str, *contents: Part, width: str) -> pmui.Dialog:
    """Return a closed window that Escape, its cross and a click beside it close.

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
    )
