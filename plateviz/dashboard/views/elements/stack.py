"""Stack: parts of the page in one place, of which one is shown."""

from collections.abc import Callable, Hashable, Mapping
from typing import Generic, TypeVar

import panel as pn
import panel_material_ui as pmui

Name = TypeVar("Name", bound=Hashable)

# A hidden part keeps the size of its figures, so that they need no new layout when it is shown
# again. `content-visibility` lets browsers that support it skip the contents of a hidden part.
_SHOWN = {
    "visibility": "inherit",
    "content-visibility": "visible",
    "height": "auto",
    "overflow": "visible",
}
_HIDDEN = {
    "visibility": "hidden",
    "content-visibility": "hidden",
    "height": "0",
    "overflow": "hidden",
}


class Stack(pn.viewable.Viewer, Generic[Name]):
    """Parts of the page, each of which is made when it is first shown."""

    def __init__(
        self, makers: Mapping[Name, Callable[[], pn.viewable.Viewable]], **params: object
    ) -> None:
        """Begin with nothing shown."""
        super().__init__(**params)
        self._makers = makers
        self._made: dict[Name, pn.viewable.Viewable] = {}
        # All containers of the figure cards are Material UI ones, whose changes stay local: in a
        # plain Panel column, every change lays out all figures of all parts again.
        self._column = pmui.Column(sizing_mode="stretch_width", margin=0)

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the place of the parts."""
        return self._column

    def show(self, name: Name) -> None:
        """Show a part; make it first if it has never been shown."""
        if name not in self._made:
            self._made[name] = self._makers[name]()
            self._made[name].styles = _SHOWN
            self._column.append(self._made[name])
        for other, part in self._made.items():
            part.styles = _SHOWN if other == name else _HIDDEN
