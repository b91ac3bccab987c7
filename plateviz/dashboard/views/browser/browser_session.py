"""BrowserSession: the key under which a tab of the browser finds its solutions after a reload."""

import panel as pn

from plateviz.dashboard.session.journal import Journal


class BrowserSession(pn.custom.JSComponent):
    """An element without a size that tells the key of the tab, which the tab keeps to itself."""

    _esm = """
    export function render({ model }) {
      const name = "plateviz-session"
      let key = null
      try { key = sessionStorage.getItem(name) } catch { return }
      if (!key) {
        const bytes = crypto.getRandomValues(new Uint8Array(16))
        key = [...bytes].map(one => one.toString(16).padStart(2, "0")).join("")
        sessionStorage.setItem(name, key)
      }
      // A page that is not whole yet loses what the server sends.
      const tell = () => {
        if (Bokeh.documents.every(one => one.is_idle)) model.send_msg(key)
        else setTimeout(tell, 50)
      }
      tell()
    }
    """
    _stylesheets = [":host { display: none; }"]

    def __init__(self, journal: Journal, **params: object) -> None:
        """Resume `journal` with what the tab has made before."""
        super().__init__(margin=0, **params)
        self._journal = journal

    def _handle_msg(self, data: object) -> None:
        self._journal.resume(str(data))
