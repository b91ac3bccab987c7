"""OwnLayout: lets a card lay out its figure alone, whatever happens around it."""

import panel as pn


class OwnLayout(pn.custom.JSComponent):
    """An invisible part of a card, which leaves the card out of the layouts of its containers.

    Whenever a container changes its height, Bokeh lays out all figures in it, hidden ones too, and
    so does each container around it: to show another workspace took five seconds. A card has its
    size from the style sheets, and hears of every change of it; nothing else concerns its figure.
    """

    # What begins a layout of the card, of which `components.js` has two, and the steps of it that
    # a container would take.
    _esm = """
    export function render({ view }) {
      const card = view.parent
      let depth = 0
      card.has_own_layout = true
      const begins = ["compute_layout", "invalidate_layout", "compute_layout_now", "write_layout"]
      for (const name of begins.filter(name => name in card)) {
        const begin = card[name].bind(card)
        card[name] = () => {
          depth++
          try { begin() } finally { depth-- }
        }
      }
      for (const name of ["update_layout", "measure_layout", "update_bbox", "_compute_layout",
                          "after_layout"]) {
        const step = card[name].bind(card)
        card[name] = () => depth > 0 ? step() : false
      }
    }
    """

    def __init__(self, **params: object) -> None:
        """Take no room."""
        super().__init__(styles={"display": "none"}, margin=0, **params)
