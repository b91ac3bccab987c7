"""Keyboard: hears the keys of the page, and lists them on "?"."""

import panel as pn
import param

from plateviz.dashboard.navigation.keys import DIGITS, KEYS, press
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.views.elements.bar_style import BAR_STYLE


class Keyboard(pn.custom.JSComponent):
    """A button that lists the keys of the page, and does what they mean when they are pressed.

    A key that is typed into a control, pressed in a window, or with Control, Alt or Meta, is left
    to it. Sliders, switches and radio buttons take no key that has a meaning here.
    """

    theme = param.Selector(default="light", objects=["light", "dark"])
    known = param.List(item_type=str, doc="keys with a meaning, as browsers name them")
    repeated = param.List(item_type=str, doc="those that act again and again while they are held")
    rows = param.List(doc="key and what it does, in the order of the list")

    _esm = """
    const TEXT = new Set(["INPUT", "TEXTAREA", "SELECT"])
    const TYPELESS = new Set(["checkbox", "radio", "range"])
    const ROLES = new Set(["combobox", "listbox", "option", "menuitem", "textbox", "dialog"])
    export function render({ model, el }) {
      const isControl = event => event.composedPath().some(one =>
        TEXT.has(one.tagName) && !TYPELESS.has(one.type) || one.isContentEditable
        || ROLES.has(one.getAttribute?.("role")))
      const sheet = document.createElement("dialog")
      sheet.setAttribute("aria-label", "Keys")
      const title = document.createElement("h2")
      title.textContent = "Keys"
      const table = document.createElement("table")
      for (const [key, does] of [...model.rows, ["?", "This list; Escape closes it"]]) {
        const row = table.insertRow(), name = document.createElement("kbd")
        name.textContent = key
        row.insertCell().append(name)
        row.insertCell().textContent = does
      }
      sheet.append(title, table)
      sheet.onclick = event => { if (event.target === sheet) sheet.close() }
      const colour = () => { sheet.className = model.theme }
      colour()
      model.on("theme", colour)
      const button = document.createElement("button")
      button.type = "button"
      button.className = "in-bar"
      button.textContent = "Keys ?"
      button.onclick = () => sheet.showModal()
      el.append(button, sheet)
      const hear = event => {
        if (event.ctrlKey || event.altKey || event.metaKey || isControl(event)) return
        if (event.key === "?") sheet.open ? sheet.close() : sheet.showModal()
        else if (sheet.open || !model.known.includes(event.key)) return
        else if (!event.repeat || model.repeated.includes(event.key)) model.send_msg(event.key)
        event.preventDefault()
      }
      document.addEventListener("keydown", hear)
      model.on("remove", () => document.removeEventListener("keydown", hear))
    }
    """

    _stylesheets = [
        BAR_STYLE,
        """
        :host { align-self: center; }
        dialog { --text: #1f2933; --line: #d5dbe1; --tile: #ffffff;
                 padding: 14px 22px 18px; border: 1px solid var(--line); border-radius: 6px;
                 font: 14px/1.5 Helvetica, Arial, sans-serif; color: var(--text);
                 background: var(--tile); }
        dialog.dark { --text: #e6eaee; --line: #39424c; --tile: #1c222a; }
        dialog::backdrop { background: rgb(0 0 0 / 35%); }
        h2 { margin: 0 0 8px; font-size: 16px; }
        td { padding: 3px 14px 3px 0; }
        kbd { display: inline-block; min-width: 14px; padding: 1px 7px; font: inherit;
              text-align: center; border: 1px solid var(--line); border-radius: 4px; }
        """,
    ]

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Do what keys mean on the page of `navigation`."""
        first, last = DIGITS[0], len(DIGITS)
        super().__init__(
            known=[*KEYS, *DIGITS],
            repeated=[key for key, one in KEYS.items() if one.is_repeated],
            rows=[
                [f"{first} to {last}", "Workspace"],
                *([key, one.does] for key, one in KEYS.items()),
            ],
            margin=0,
            **params,
        )
        self._navigation = navigation
        navigation.session.param.watch(self._follow_theme, "theme")

    def _handle_msg(self, data: object) -> None:
        # What follows from it is sent as one message.
        with pn.io.hold():
            press(self._navigation, str(data))

    def _follow_theme(self, *_: object) -> None:
        self.theme = self._navigation.session.theme
