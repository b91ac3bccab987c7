"""Places of cards in the grid of a page."""

from plateviz.dashboard.views.cards.figure import FigureView


def takes_row(view: FigureView) -> bool:
    """Return whether a card takes a whole row of its grid."""
    return any("grid-column: 1 / -1" in sheet for sheet in view.__panel__().stylesheets)
