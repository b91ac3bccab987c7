"""SolutionDialog: the solutions of a page in a dialog, to be shown, named, kept and noted upon."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.solution_list import Entry, SolutionList, by_label
from plateviz.dashboard.views.dialogs.dialog import dialog
from plateviz.dashboard.views.elements.markup import alert_words
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import table_choices
from plateviz.runs.kept_solutions import KeptSolution, require_name
from plateviz.runs.note import MOST_BYTES, Note, NoteChangedError, read_note, write_note
from plateviz.solving.made_solutions import MadeSolution
from solver.errors import InputError

_SAVED, _UNSAVED = "Note", "Note (not saved)"


class _Draft(NamedTuple):
    """A note that was written and is not saved.

    Attributes
    ----------
    text : that was written
    note : that saving it replaces
    is_theirs_shown : whether somebody else has changed the note, which is shown beside the text
    """

    text: str
    note: Note
    is_theirs_shown: bool


class SolutionDialog(pn.viewable.Viewer):
    """A dialog with the solutions of the session, the kept ones and those of the runs."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Begin closed."""
        super().__init__(**params)
        self._session = navigation.session
        self._list = SolutionList(navigation)
        self._note = Note("", "")
        self._path: Path | None = None
        self._drafts: dict[Path, _Draft] = {}
        self._described: Entry | None = None
        wide = {"sizing_mode": "stretch_width", "size": "small"}
        self._choice = pmui.RadioBoxGroup(options={}, sizing_mode="stretch_width")
        self._name = pmui.TextInput(label="Name", max_length=60, **wide)
        self._text = pmui.TextAreaInput(
            label=_SAVED, max_length=MOST_BYTES, auto_grow=True, max_rows=12, **wide
        )
        self._rename = _button("Rename", self._give_name)
        self._keep = _button("Keep on disk", self._keep_on_disk)
        self._save = _button("Save the note", self._save_note)
        self._message = pmui.Alert(
            object="", visible=False, margin=(8, 10), sizing_mode="stretch_width"
        )
        self._theirs = pmui.TextAreaInput(
            label="The note as somebody else has left it", disabled=True, visible=False, **wide
        )
        choices = table_choices(lambda: "solutions", self._files)
        self._save_list = SaveButton("solutions", choices, text="Save the list", align="center")
        self._dialog = dialog(
            "Solutions",
            self._choice,
            pmui.Row(
                _button("Show", self._show),
                _button("Compare with it", self._compare),
                self._save_list,
                margin=0,
            ),
            pmui.Row(self._name, self._rename, self._keep, sizing_mode="stretch_width", margin=0),
            self._text,
            self._theirs,
            self._save,
            self._message,
            width="md",
        )
        self._choice.param.watch(self._choose, "value")
        self._name.param.watch(self._check_name, "value_input")
        self._text.param.watch(self._take_draft, "value_input")
        self._session.journal.param.watch(self._follow, "made")
        self._session.param.watch(self._follow, "shown")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the dialog."""
        return self._dialog

    def open(self) -> None:
        """Open the dialog."""
        self._dialog.open = True
        self._session.journal.look()
        self._save_list.theme = self._session.theme
        self._fill()

    @property
    def _chosen(self) -> Entry | None:
        found = self._choice.value
        return found if isinstance(found, Entry) else None

    def _files(self) -> dict[str, Table]:
        """Return the list as a table of texts: files of one orbit have no number of an orbit."""
        entries = self._list.entries()
        names = ("orbit", "name", "settings", "made")
        texts = {name: [str(getattr(one, name) or "") for one in entries] for name in names}
        texts["orbit"] = ["" if one.orbit is None else str(one.orbit) for one in entries]
        return {"solutions": Table(texts)}

    def _follow(self, *_: object) -> None:
        if self._dialog.open:
            self._fill()

    def _fill(self) -> dict[str, Entry]:
        """List the solutions; return them by their labels."""
        options = by_label(self._list.entries())
        before = self._chosen
        same = (one for one in options.values() if before and _is_same(one, before))
        value = next(same, next(iter(options.values()), None))
        self._choice.param.update(options=options, value=value)
        self._choose()
        return options

    def _choose(self, *_: object) -> None:
        entry, before = self._chosen, self._described
        self._described = entry
        name, path = (entry.name, entry.note_path) if entry else ("", None)
        is_same = entry is not None and before is not None and _is_same(entry, before)
        if not is_same or before is None or name != before.name:
            self._name.value = name
        is_made = entry is not None and isinstance(entry.what, MadeSolution)
        self._rename.disabled = self._keep.disabled = self._name.disabled = not is_made
        if is_same and path in self._drafts:
            # The list is filled again while somebody writes.
            return
        self._say("")
        self._path, self._theirs.visible = None, False
        if path is not None:
            self._try(lambda: self._open_note(path))
        self._text.visible = self._save.visible = self._path is not None

    def _open_note(self, path: Path) -> None:
        note = read_note(path)
        self._path = path
        self._put_note(note, self._drafts.get(path))

    def _put_note(self, note: Note, draft: _Draft | None = None) -> None:
        """Show a note, or what was written in place of it."""
        self._note = note if draft is None else draft.note
        text = note.text if draft is None else draft.text
        self._text.param.update(value=text, value_input=text)
        if draft is not None and draft.is_theirs_shown:
            self._show_theirs(draft.note)
        self._take_draft()

    def _take_draft(self, *_: object) -> None:
        """Remember what is written and not saved."""
        text, path = self._text.value_input or "", self._path
        is_saved = text == self._note.text
        self._text.label = _SAVED if is_saved else _UNSAVED
        if path is not None and not is_saved:
            self._drafts[path] = _Draft(text, self._note, bool(self._theirs.visible))
        elif path is not None:
            self._drafts.pop(path, None)

    def _show_theirs(self, note: Note) -> None:
        self._theirs.param.update(value=note.text, visible=True)

    def _show(self) -> None:
        if (entry := self._chosen) is not None:
            self._try(lambda: self._session.open_listed(self._list.load(entry)))

    def _compare(self) -> None:
        if (entry := self._chosen) is not None:
            self._try(lambda: self._session.compare_with(self._list.to_compare_with(entry)))

    def _give_name(self) -> None:
        if (entry := self._chosen) is not None:
            self._try(lambda: self._list.rename(entry, self._name.value))

    def _keep_on_disk(self) -> None:
        if (entry := self._chosen) is not None:
            self._try(lambda: self._keep_as(entry, (self._name.value or "").strip()))

    def _keep_as(self, entry: Entry, name: str) -> None:
        self._list.keep(entry, name)
        # The list has it as one of the kept solutions, too, with its name and a note.
        options = self._fill()
        kept = (one for one in options.values() if _is_kept(one, name))
        self._choice.value = next(kept, self._choice.value)
        self._say(f"It is kept on disk as {name}.", "success")

    def _check_name(self, *_: object) -> None:
        """Say below a name while it is typed whether a solution can be kept under it."""
        name, why = (self._name.value_input or "").strip(), ""
        try:
            if name:
                require_name(name)
        except InputError as error:
            why = f"To be kept on disk: {error}"
        self._name.param.update(error_state=bool(why), helper_text=why)

    def _save_note(self) -> None:
        path = self._path
        if path is None:
            return
        try:
            saved = write_note(path, self._text.value_input or "", self._note.version)
        except NoteChangedError as error:
            # What was written here stays, beside what is there; saved again, it replaces that.
            self._note = error.note
            self._show_theirs(error.note)
            self._take_draft()
            self._say(f"{error}. Join the two texts and save again.")
        except InputError as error:
            self._say(str(error))
        else:
            self._theirs.visible = False
            self._put_note(saved)
            self._say("The note is saved.", severity="success")

    def _try(self, act: Callable[[], object]) -> None:
        try:
            act()
        except InputError as error:
            self._say(str(error))

    def _say(self, text: str, severity: str = "error") -> None:
        text = text[:1].upper() + text[1:]
        self._message.param.update(object=alert_words(text), visible=bool(text), severity=severity)


def _is_same(one: Entry, other: Entry) -> bool:
    """Whether both are the same solution, which may have got another name."""
    if isinstance(one.what, MadeSolution) and isinstance(other.what, MadeSolution):
        return one.what.is_of(other.what)
    return one.what == other.what


def _is_kept(entry: Entry, name: str) -> bool:
    return isinstance(entry.what, KeptSolution) and entry.what.name == name


def _button(label: str, act: Callable[[], None]) -> pmui.Button:
    button = pmui.Button(label=label, variant="outlined", size="small")
    # Of several fast clicks, the first may have switched the button off.
    button.on_click(lambda _: None if button.disabled else act())
    return button
