"""SystemTheme: tells whether the person's system is dark."""

import panel as pn
import param


class SystemTheme(pn.custom.JSComponent):
    """An element without a size that asks the browser once, when the page is opened."""

    is_dark = param.Boolean(default=False, doc="whether the system prefers dark pages")

    _esm = """
    export function render({ model }) {
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
