"""Visibility: whether a part of the page is on or near the screen."""

import panel as pn
import param


class Visibility(pn.custom.JSComponent):
    """A background of its container, of the same size, that reports when it is near the screen.

    A part without a layout, such as one in a hidden view, is not near.
    """

    is_near = param.Boolean(default=False, doc="whether it is on the screen or close to it")

    # The page scrolls inside a container, beyond whose edge only `scrollMargin` reaches. A browser
    # that does not support it reports only what is on the screen.
    _esm = """
    export function render({ model, el }) {
      const near = "600px 0px"
      const observer = new IntersectionObserver(
        entries => { model.is_near = entries.at(-1).isIntersecting },
        { rootMargin: near, scrollMargin: near },
      )
      observer.observe(el.getRootNode().host)
      model.on("remove", () => observer.disconnect())
    }
    """

    def __init__(self, **params: object) -> None:
        """Fill the nearest positioned ancestor."""
        behind = {"position": "absolute", "inset": "0", "z-index": "-1", "pointer-events": "none"}
        super().__init__(styles=behind, margin=0, **params)
