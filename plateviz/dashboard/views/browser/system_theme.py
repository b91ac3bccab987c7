"""SystemTheme: the theme of the person's system, and that of the page where no model has it."""

import panel as pn
import param

from plateviz.figures.theme import THEMES


class SystemTheme(pn.custom.JSComponent):
    """An element without a size that asks the browser once, when the page is opened.

    It also gives the theme of the page to the words at the pointer, which stand apart from the
    figures and are white without it.
    """

    is_dark = param.Boolean(default=False, doc="whether the system prefers dark pages")
    style = param.String(doc="style sheet of what stands apart from the page")

    _esm = """
    export function render({ model }) {
      const sheet = document.head.appendChild(document.createElement("style"))
      const follow = () => { sheet.textContent = model.style }
      model.on("style", follow)
      follow()
      if (!matchMedia("(prefers-color-scheme: dark)").matches) return
      // A page that is not whole yet loses what the server sends of its theme.
      const tell = () => {
        if (Bokeh.documents.every(one => one.is_idle)) model.is_dark = true
        else setTimeout(tell, 50)
      }
      tell()
    }
    """
    _stylesheets = [":host { display: none; }"]

    def follow(self, theme: str) -> None:
        """Take the theme of the page, "light" or "dark"."""
        colours = THEMES[theme]
        self.style = (
            f".bk-Tooltip {{ --tooltip-color: {colours.background}; "
            f"--tooltip-text: {colours.text}; --tooltip-border: {colours.muted}; "
            f"--tooltip-arrow-color: {colours.muted}; opacity: 1; "
            # The values of three sources would cover their figure.
            "font-size: 12px; line-height: 1.3; }"
        )
