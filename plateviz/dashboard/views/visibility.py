"""Visibility: whether a part of the page is on the screen, or about to be."""

import panel as pn
import param


class Visibility(pn.custom.JSComponent):
    """Lies behind what it stands in and has its size; tells when the browser comes near it.

    A part that is not laid out, of a view that is not on the screen, say, is not near.
    """

    is_near = param.Boolean(default=False, doc="whether it is on the screen or close to it")

    # The page scrolls within itself: only `scrollMargin` reaches beyond such an edge. A browser
    # that does not know it tells of what is on the screen, and no sooner.
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
        """Fill the next positioned ancestor."""
        behind = {"position": "absolute", "inset": "0", "z-index": "-1", "pointer-events": "none"}
        super().__init__(styles=behind, margin=0, **params)
