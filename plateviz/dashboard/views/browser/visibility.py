"""Visibility: whether a part of the page is on or near the screen, how large it is, and faded."""

import panel as pn
import param

FADING = "fading"
"""CSS class of what is faded."""


class Visibility(pn.custom.JSComponent):
    """A background of its container, of the same size, that reports that size and where it is.

    A part without a layout, such as one in a hidden view, is not near, and keeps its last size.
    It fades what has the class `FADING` in its container; a change of its styles would let Bokeh
    measure the page for each part.
    """

    is_near = param.Boolean(default=False, doc="whether it is on the screen or close to it")
    is_faded = param.Boolean(default=False, doc="whether its container shows what is out of date")
    room = param.List(default=[0, 0], item_type=int, doc="width and height, screen pixels")

    # The page scrolls inside a container, beyond whose edge only `scrollMargin` reaches. A browser
    # that does not support it reports only what is on the screen.
    _esm = """
    export function render({ model, el }) {
      const near = "300px 0px", host = el.getRootNode().host
      const fade = () => {
        for (const { style } of host.getRootNode().querySelectorAll(".fading")) {
          // What follows within 0.4 s is not faded before.
          style.transition = model.is_faded ? "opacity 0s 0.4s" : ""
          style.opacity = model.is_faded ? 0.45 : 1
        }
      }
      model.on("is_faded", fade)
      const measure = box => {
        const room = [Math.round(box.width), Math.round(box.height)]
        if (room[0] > 0 && room[1] > 0 && `${room}` !== `${model.room}`) model.room = room
      }
      const place = new IntersectionObserver(entries => {
        const last = entries.at(-1)
        fade()
        if (last.isIntersecting) measure(last.boundingClientRect)
        model.is_near = last.isIntersecting
      }, { rootMargin: near, scrollMargin: near })
      // While an edge of the window is dragged, only the last size is drawn.
      let waiting = null
      const size = new ResizeObserver(entries => {
        clearTimeout(waiting)
        waiting = setTimeout(() => measure(host.getBoundingClientRect()), 120)
      })
      place.observe(host)
      size.observe(host)
      model.on("remove", () => { place.disconnect(); size.disconnect() })
    }
    """

    def __init__(self, **params: object) -> None:
        """Fill the nearest positioned ancestor."""
        behind = {
            "position": "absolute",
            "inset": "0",
            "width": "100%",
            "height": "100%",
            "z-index": "-1",
            "pointer-events": "none",
        }
        super().__init__(styles=behind, margin=0, **params)
