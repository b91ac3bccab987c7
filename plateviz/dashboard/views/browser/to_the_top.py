"""ToTheTop: lets each view and workspace open at its top, although all share one scroll bar."""

import panel as pn
import param

from plateviz.dashboard.navigation.navigation import WORKSPACES, Navigation


class ToTheTop(pn.custom.JSComponent):
    """An element without a size that scrolls the page when another part of it is shown.

    A callback of a control in the browser would do, but for a page with one, Panel goes through all
    parts and models of the page at each change.
    """

    shown = param.String(doc="view and workspace on the screen")

    _esm = """
    export function render({ model }) {
      const scroll = () => {
        for (const host of document.querySelectorAll("*"))
          host.shadowRoot?.querySelector(".main-content")?.scrollTo(0, 0)
      }
      // With the next picture: before, the browser would lay the page out for it.
      model.on("shown", () => requestAnimationFrame(scroll))
    }
    """

    _stylesheets = [":host { display: none; }"]

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the view and the workspace of `navigation`."""
        super().__init__(margin=0, **params)
        self._navigation = navigation
        navigation.param.watch(self._follow, ["view", *WORKSPACES.values()])
        self._follow()

    def _follow(self, *_: object) -> None:
        self.shown = f"{self._navigation.view} {self._navigation.workspace}"
