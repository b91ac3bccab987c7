"""CardTools: the buttons in the corner of a card that explain it and open it large."""

import panel as pn
import param


class CardTools(pn.custom.JSComponent):
    """Two buttons: one shows what the card shows, the other fills the window with the card.

    Escape closes either.
    """

    title = param.String(doc="what the card shows, in a few words")
    theme = param.Selector(default="light", objects=["light", "dark"])
    help = param.String(doc="what it shows and how it looks for a good solution")

    _esm = """
    export function render({ model, el }) {
      const host = el.getRootNode().host
      let card = host
      while (card && !card.classList?.contains("card"))
        card = card.parentElement ?? card.getRootNode().host
      const button = (label, text) => {
        const made = document.createElement("button")
        made.type = "button"
        made.textContent = text
        made.title = label
        made.setAttribute("aria-label", `${label}: ${model.title}`)
        return made
      }
      const explain = button("What this shows", "?")
      const enlarge = button("Open large", "\\u2922")
      const words = document.createElement("p")
      words.textContent = model.help
      words.hidden = true
      explain.setAttribute("aria-expanded", "false")
      const show = isShown => {
        words.hidden = !isShown
        explain.setAttribute("aria-expanded", String(isShown))
      }
      let before = null
      const fill = () => {
        before = card.getAttribute("style")
        Object.assign(card.style, { position: "fixed", inset: "8px", zIndex: 2000,
                                    width: "auto", height: "auto", margin: "0" })
        enlarge.textContent = "\\u00d7"
        enlarge.title = "Close"
      }
      const close = () => {
        card.setAttribute("style", before ?? "")
        before = null
        enlarge.textContent = "\\u2922"
        enlarge.title = "Open large"
      }
      const isLarge = () => before !== null
      explain.onclick = () => show(words.hidden)
      enlarge.onclick = () => isLarge() ? close() : fill()
      const escape = event => {
        if (event.key !== "Escape") return
        if (!words.hidden) show(false)
        else if (isLarge()) close()
      }
      document.addEventListener("keydown", escape)
      model.on("remove", () => document.removeEventListener("keydown", escape))
      const corner = document.createElement("div")
      const colour = () => { corner.className = `corner ${model.theme}` }
      colour()
      model.on("theme", colour)
      corner.append(words, explain, enlarge)
      el.append(corner)
    }
    """

    _stylesheets = [
        """
        :host { position: absolute; top: 2px; right: 2px; z-index: 3; max-width: 70%; }
        .corner { --text: #1f2933; --muted: #52606d; --line: #d5dbe1; --tile: #ffffff;
                  display: flex; gap: 2px; align-items: flex-start; justify-content: flex-end; }
        .corner.dark { --text: #e6eaee; --muted: #a5b0bb; --line: #39424c; --tile: #1c222a; }
        button { width: 24px; height: 24px; padding: 0; border: 0; border-radius: 4px;
                 font: 14px Helvetica, Arial, sans-serif; color: var(--muted);
                 background: transparent; cursor: pointer; }
        button:hover, button:focus-visible { background: var(--line); color: var(--text); }
        p { margin: 0; padding: 10px 14px; border: 1px solid var(--line); border-radius: 4px;
            font: 13px/1.45 Helvetica, Arial, sans-serif; color: var(--text);
            background: var(--tile); box-shadow: 0 2px 10px rgb(0 0 0 / 25%); }
        p[hidden] { display: none; }
        """
    ]

    def __init__(self, title: str, help: str, **params: object) -> None:  # noqa: A002 as param
        """Stand in the upper right corner of the nearest positioned ancestor."""
        super().__init__(title=title, help=help, margin=0, **params)
