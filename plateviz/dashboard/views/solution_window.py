"""SolutionWindow: the solutions of a page in a window, to be shown, named, kept and noted upon."""

from collections.abc import Callable
from html import escape

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation import Navigation
from plateviz.dashboard.solution import Request
from plateviz.dashboard.solution_list import Entry, SolutionList, by_label
from plateviz.dashboard.views.window import window
from plateviz.runs.note import MOST_BYTES, Note, NoteChangedError, read_note, write_note
from plateviz.solving.made_solutions import MadeSolution
from solver.errors import InputError


class SolutionWindow(pn.viewable.Viewer):
    """A window with the solutions of the session, the kept ones and those of the runs."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Begin closed."""
        super().__init__(**params)
        self._session = navigation.session
        self._list = SolutionList(navigation)
        self._note = Note("", "")
        wide = {"sizing_mode": "stretch_width", "size": "small"}
        self._choice = pmui.RadioBoxGroup(options={}, sizing_mode="stretch_width")
        self._name = pmui.TextInput(label="Name", max_length=60, **wide)
        self._text = pmui.TextAreaInput(
            label="Note", max_length=MOST_BYTES, auto_grow=True, max_rows=12, **wide
        )
        self._rename = _button("Rename", self._give_name)
        self._keep = _button("Keep on disk", self._keep_on_disk)
        self._save = _button("Save the note", self._save_note)
        self._message = pmui.Alert(object="", visible=False, sizing_mode="stretch_width")
        self._theirs = pmui.TextAreaInput(
            label="The note as somebody else has left it", disabled=True, visible=False, **wide
        )
        self._window = window(
            "Solutions",
            self._choice,
            pmui.Row(
                _button("Show", self._show), _button("Compare with it", self._compare), margin=0
            ),
            pmui.Row(self._name, self._rename, self._keep, sizing_mode="stretch_width", margin=0),
            self._text,
            self._theirs,
            self._save,
            self._message,
            width="md",
        )
        self._choice.param.watch(self._choose, "value")
        self._session.journal.param.watch(self._follow, "made")
        self._session.param.watch(self._follow, "shown")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the window."""
        return self._window

    def open(self) -> None:
        """Open the window."""
        self._window.open = True
        self._fill()

    @property
    def _chosen(self) -> Entry | None:
        found = self._choice.value
        return found if isinstance(found, Entry) else None

    def _follow(self, *_: object) -> None:
        if self._window.open:
            self._fill()

    def _fill(self) -> None:
        options = by_label(self._list.entries())
        before = self._chosen
        same = (one for one in options.values() if before and one.what == before.what)
        value = next(same, next(iter(options.values()), None))
        self._choice.param.update(options=options, value=value)
        self._choose()

    def _choose(self, *_: object) -> None:
        entry = self._chosen
        is_made = entry is not None and isinstance(entry.what, MadeSolution)
        self._name.param.update(value=entry.name if entry else "", disabled=not is_made)
        self._rename.disabled = self._keep.disabled = not is_made
        self._theirs.visible = False
        self._say("")
        path = entry.note_path if entry else None
        self._text.visible = self._save.visible = path is not None
        if path is not None:
            self._try(lambda: self._put_note(read_note(path)))

    def _put_note(self, note: Note) -> None:
        self._note = note
        self._text.value = note.text

    def _show(self) -> None:
        if (entry := self._chosen) is not None:
            self._try(lambda: self._session.open_listed(self._list.load(entry)))

    def _compare(self) -> None:
        if (entry := self._chosen) is not None:
            self._try(lambda: self._compare_with(entry))

    def _compare_with(self, entry: Entry) -> None:
        found = self._list.load(entry)
        if isinstance(found, Request):
            raise InputError("this solution has to be fitted again: show it first")
        self._session.compare_with(found)

    def _give_name(self) -> None:
        if (entry := self._chosen) is not None:
            self._list.rename(entry, self._name.value)

    def _keep_on_disk(self) -> None:
        if (entry := self._chosen) is not None:
            self._try(lambda: self._list.keep(entry, self._name.value.strip()))

    def _save_note(self) -> None:
        path = self._chosen.note_path if self._chosen else None
        if path is None:
            return
        try:
            self._put_note(write_note(path, self._text.value, self._note.version))
        except NoteChangedError as error:
            # What was written here stays, beside what is there; saved again, it replaces that.
            self._note = error.note
            self._theirs.param.update(value=error.note.text, visible=True)
            self._say(f"{error}. Join the two texts and save again.")
        except InputError as error:
            self._say(str(error))
        else:
            self._theirs.visible = False
            self._say("The note is saved.", severity="success")

    def _try(self, act: Callable[[], object]) -> None:
        try:
            act()
        except InputError as error:
            self._say(str(error))

    def _say(self, text: str, severity: str = "error") -> None:
        # It is taken for Markdown, in which HTML would be kept.
        text = text[:1].upper() + text[1:]
        self._message.param.update(object=escape(text), visible=bool(text), severity=severity)


def _button(label: str, act: Callable[[], None]) -> pmui.Button:
    button = pmui.Button(label=label, variant="outlined", size="small")
    button.on_click(lambda _: act())
    return button
