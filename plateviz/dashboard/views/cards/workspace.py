"""A workspace: cards that fill the screen below what stands above them."""

from collections.abc import Sequence

import panel_material_ui as pmui

from plateviz.dashboard.views.cards.figure import Part
from plateviz.dashboard.views.cards.figure_grid import FigureGrid

# Screen pixels above a workspace: the page's bar, the switches, the verdict.
_ABOVE = 154
# Property of a page's style: the height of what stands above its workspaces beside that.
_MORE_ABOVE = "--more-above"
_LINE = 32


def workspace(grid: FigureGrid, *above: Part, below: Sequence[Part] = ()) -> pmui.FlexBox:
    """Return a workspace as high as the rest of the window, or higher where its cards need it.

    Parameters
    ----------
    above, below : what stands above and below the cards
    """
    rows = ["auto"] * bool(above) + ["minmax(0, 1fr)"] + ["auto"] * len(below)
    # In one row, whichever of them are hidden: the cards have the row that fills the window.
    head = [_rows(*above)] if above else []
    return pmui.FlexBox(
        *head,
        grid,
        *below,
        sx={
            "display": "grid",
            "gridTemplateColumns": "minmax(0, 1fr)",
            "gridTemplateRows": " ".join(rows),
            "gap": "8px",
            "minHeight": f"calc(100vh - {_ABOVE}px - var({_MORE_ABOVE}, 0px))",
        },
        sizing_mode="stretch_width",
        margin=0,
    )


def below_lines(number: int) -> dict[str, str]:
    """Return the style of a page with lines of text between its verdict and its workspaces."""
    return {_MORE_ABOVE: f"{number * _LINE}px"}


def _rows(*parts: Part) -> pmui.FlexBox:
    return pmui.FlexBox(
        *parts,
        sx={"display": "grid", "gridTemplateColumns": "minmax(0, 1fr)", "gap": "8px"},
        sizing_mode="stretch_width",
        margin=0,
    )
