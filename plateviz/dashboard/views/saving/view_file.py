"""ViewFile: saves what is on the screen as a file, and opens such a file."""

import panel as pn
import param

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.saved_view import MOST_BYTES, open_view, view_text
from plateviz.dashboard.saving.downloads import file_name
from plateviz.dashboard.views.elements.bar_style import BAR_STYLE
from solver.errors import InputError


class ViewFile(pn.custom.JSComponent):
    """Two buttons of the page's bar."""

    most = param.Integer(doc="bytes of a file that is sent to the server")

    _esm = """
    export function render({ model, el }) {
      const button = (text, title, act) => {
        const made = document.createElement("button")
        made.type = "button"
        made.className = "in-bar"
        made.textContent = text
        made.title = title
        made.onclick = act
        return made
      }
      const file = document.createElement("input")
      file.type = "file"
      file.accept = ".json,application/json"
      file.hidden = true
      file.setAttribute("aria-label", "File of a saved view")
      file.onchange = async () => {
        const [chosen] = file.files
        if (!chosen) return
        // What is too large for a message is not sent.
        const text = chosen.size > model.most ? null : await chosen.text()
        file.value = ""
        model.send_msg({ text })
      }
      model.on("msg:custom", ({ name, text }) => {
        const link = document.createElement("a")
        link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }))
        link.download = name
        link.click()
        setTimeout(() => URL.revokeObjectURL(link.href), 60_000)
      })
      el.append(
        button("Save view", "Save what is on the screen as a small file",
               () => model.send_msg({})),
        button("Open view", "Show what such a file holds", () => file.click()),
        file)
    }
    """
    _stylesheets = [
        BAR_STYLE,
        ":host { margin-left: auto; align-self: center; white-space: nowrap; }",
    ]

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Save and open what is on the page of `navigation`."""
        super().__init__(most=MOST_BYTES, margin=0, **params)
        self._navigation = navigation

    def _handle_msg(self, data: object) -> None:
        content = data if isinstance(data, dict) else {}
        is_file = "text" in content
        session = self._navigation.session
        try:
            if is_file:
                self._open(content["text"])
            else:
                name = file_name(f"{session.store.title}-view", ".json")
                self._send_msg({"name": name, "text": view_text(self._navigation)})
        except InputError as error:
            session.notice = f"The view was not {'opened' if is_file else 'saved'}: {error}."

    def _open(self, text: object) -> None:
        if not isinstance(text, str):
            raise InputError(f"expected a saved view of {MOST_BYTES:,} bytes or fewer")
        open_view(self._navigation, text)
