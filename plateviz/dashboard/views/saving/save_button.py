"""SaveButton: a menu of what a figure or a table can be saved as."""

import json
import logging
import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import panel as pn
import param
from bokeh.document import Document

from plateviz.dashboard.saving.downloads import Download, Later
from plateviz.dashboard.views.elements.bar_style import BAR_STYLE
from solver.errors import FitError, InputError

_LOG = logging.getLogger(__name__)
# A file that cannot be made must not leave a person without a word.
_FAULTS = (
    ArithmeticError,
    AttributeError,
    LookupError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
)


class Picture(NamedTuple):
    """A picture that the browser draws and saves.

    Attributes
    ----------
    name : of the file; its suffix is that of the format, "png" or "svg"
    item : Bokeh models as JSON, made for this picture only
    """

    name: str
    item: dict[str, Any]


Choices = Mapping[str, Callable[[], Download | Picture | Later]]


class SaveButton(pn.custom.JSComponent):
    """A button with a menu; a choice is made into a file that the browser keeps.

    A button with a single choice has no menu. What cannot be saved says why below the button. Of
    the files that take seconds, one is made at a time.
    """

    text = param.String(default="Save", doc="what the button says")
    done = param.String(default="saved", doc="what the button does, as a participle")
    title = param.String(doc="what is saved, in a few words")
    theme = param.Selector(default="light", objects=["light", "dark"])
    labels = param.List(item_type=str, doc="the choices in order")
    place = param.Selector(
        default="line",
        objects=["line", "corner", "bar"],
        doc="where it stands: in a line of a page, beside the tools of a card, in the page's bar",
    )

    _esm = """
    const keep = (name, blob) => {
      const link = document.createElement("a")
      link.href = URL.createObjectURL(blob)
      link.download = name
      link.click()
      setTimeout(() => URL.revokeObjectURL(link.href), 60_000)
    }
    const pause = () => new Promise(done => setTimeout(done, 50))
    const draw = async (name, item) => {
      const place = document.createElement("div")
      place.id = `picture-${crypto.randomUUID?.() ?? Math.random()}`
      Object.assign(place.style, { position: "fixed", left: "-20000px", top: "0" })
      place.setAttribute("aria-hidden", "true")
      document.body.append(place)
      const views = await Bokeh.embed.embed_item(JSON.parse(item), place.id)
      const view = [...views][0]
      const drawn = view.model.document
      try {
        for (let turn = 0; turn < 200 && !drawn.is_idle; turn++) await pause()
        await pause()
        // As SVG, Bokeh measures a legend beside the frame before the marks in it have their size.
        for (const plot of views.query(one => "below" in one.model)) plot.invalidate_layout()
        await pause()
        keep(name, await view.export(name.split(".").pop()).to_blob())
      } finally {
        views.clear()
        const at = Bokeh.documents.indexOf(drawn)
        if (at >= 0) Bokeh.documents.splice(at, 1)
        place.remove()
      }
    }
    export function render({ model, el }) {
      const box = document.createElement("div")
      const button = document.createElement("button")
      const menu = document.createElement("div")
      const words = document.createElement("p")
      button.type = "button"
      const { text, title, place, labels, done } = model
      button.textContent = { line: `\\u2913 ${text}`, corner: "\\u2913", bar: text }[place]
      button.title = text
      if (place === "bar") button.className = "in-bar"
      button.setAttribute("aria-label", `${text}: ${title}`)
      if (labels.length > 1) button.setAttribute("aria-haspopup", "menu")
      menu.setAttribute("role", "menu")
      words.setAttribute("role", "status")
      const show = isShown => {
        menu.hidden = !isShown
        if (labels.length > 1) button.setAttribute("aria-expanded", String(isShown))
      }
      const say = text => { words.textContent = text; words.hidden = !text }
      show(false)
      say("")
      let isBusy = false
      const ask = label => {
        isBusy = true
        show(false)
        say(`Being ${done} \\u2026`)
        model.send_msg(label)
      }
      for (const label of labels) {
        const entry = document.createElement("button")
        entry.type = "button"
        entry.textContent = label
        entry.setAttribute("role", "menuitem")
        entry.onclick = () => ask(label)
        menu.append(entry)
      }
      button.onclick = () => {
        if (labels.length === 1) return ask(labels[0])
        say("")
        show(menu.hidden)
      }
      box.addEventListener("focusout", event => {
        if (box.contains(event.relatedTarget)) return
        show(false)
        if (!isBusy) say("")
      })
      box.addEventListener("keydown", event => {
        if (event.key !== "Escape" || menu.hidden) return
        event.stopPropagation()
        show(false)
        button.focus()
      })
      const tell = text => {
        say(text)
        setTimeout(() => { if (words.textContent === text) say("") }, 12_000)
      }
      model.on("msg:custom", async ({ name, content, item, text, more }) => {
        isBusy = Boolean(more)
        try {
          if (text) return more ? say(text) : tell(text)
          if (item) await draw(name, item)
          else keep(name, new Blob([content]))
          say("")
        } catch (problem) { tell(`It could not be saved: ${problem.message}`) }
      })
      const colour = () => {
        box.className = `save ${model.theme} ${model.place}`
      }
      colour()
      model.on("theme", colour)
      box.append(button, menu, words)
      el.append(box)
    }
    """

    _stylesheets = [
        """
        :host(.save-in-corner) { position: absolute; top: 2px; right: 54px; z-index: 3; }
        :host(.save-in-bar) { align-self: center; }
        .save { --text: #1f2933; --muted: #52606d; --line: #d5dbe1; --tile: #ffffff;
                position: relative; }
        .save.dark { --text: #e6eaee; --muted: #a5b0bb; --line: #39424c; --tile: #1c222a; }
        button { padding: 0; border: 0; border-radius: 4px; background: transparent;
                 font: 14px Helvetica, Arial, sans-serif; color: var(--muted); cursor: pointer; }
        .save > button { height: 24px; padding: 0 6px; }
        .corner > button { width: 24px; padding: 0; }
        button:hover, button:focus-visible { background: var(--line); color: var(--text); }
        div[role=menu], p { position: absolute; right: 0; top: 26px; z-index: 4; margin: 0;
            border: 1px solid var(--line); border-radius: 4px; background: var(--tile);
            box-shadow: 0 2px 10px rgb(0 0 0 / 25%); }
        .line > div[role=menu], .line > p { right: auto; left: 0; }
        div[role=menu]:not([hidden]) { display: grid; min-width: 120px; padding: 4px; }
        [hidden] { display: none; }
        div[role=menu] button { padding: 6px 10px; text-align: left; font-size: 13px;
                                white-space: nowrap;
                                color: var(--text); }
        p { padding: 8px 12px; width: max-content; max-width: 260px; color: var(--text);
            font: 13px/1.4 Helvetica, Arial, sans-serif; }
        """,
        BAR_STYLE,
    ]

    def __init__(self, title: str, choices: Choices, **params: object) -> None:
        """Offer the choices: what the menu says -> function that makes the file."""
        super().__init__(title=title, labels=list(choices), margin=0, **params)
        self._choices = choices
        self._is_making = False
        self.css_classes = [f"save-in-{self.place}"]

    def _handle_msg(self, data: object) -> None:
        make = self._choices.get(str(data))
        if make is None:
            return
        try:
            made = make()
            if isinstance(made, Later):
                self._begin(made)
                return
            message = (
                {"name": made.name, "item": json.dumps(made.item)}
                if isinstance(made, Picture)
                else made._asdict()
            )
        except _FAULTS as error:
            message = self._reason(error)
        self._send_msg(message)

    def _reason(self, error: Exception) -> dict[str, object]:
        """Return the message that says why there is no file; log what nobody has expected."""
        could_not = f"It could not be {self.done}"
        if isinstance(error, InputError | FitError):
            return {"text": f"{could_not}: {error}."}
        _LOG.error("%s: a file cannot be made", self.title, exc_info=error)
        why = f"{type(error).__name__}: {error}"
        return {"text": f"{could_not}: {why}. The server's log has the details."}

    def _begin(self, later: Later) -> None:
        """Make a file on a thread, unless one is being made."""
        if self._is_making:
            self._send_msg({"text": "The one before is not done yet.", "more": True})
            return
        self._is_making = True
        work = partial(self._make, later, pn.state.curdoc)
        threading.Thread(target=work, daemon=True).start()

    def _make(self, later: Later, document: Document | None) -> None:
        """Make a file, and let the page say how far it is; runs on a thread."""

        def send(message: dict[str, object]) -> None:
            # The page changes on its own thread only.
            if document is not None:
                document.add_next_tick_callback(partial(self._send_msg, message))

        def progress(done: int, total: int) -> None:
            send({"text": f"Being {self.done} \u2026 {done} of {total}", "more": True})

        def wait(place: int) -> None:
            before = "the one" if place == 1 else f"the {place}"
            send({"text": f"Waiting for {before} of other pages before it \u2026", "more": True})

        text = f"It could not be {self.done}; the server's log says why."
        message: dict[str, object] = {"text": text}
        try:
            with later.turn(wait):
                if document is not None and document.session_context is None:
                    # The page was closed while the file waited.
                    return
                made = later.make(progress)
            message = made._asdict()
        except _FAULTS as error:
            message = self._reason(error)
        finally:
            self._is_making = False
            send(message)
