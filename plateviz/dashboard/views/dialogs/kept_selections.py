"""KeptSelectionsDialog: a dialog in which selections are kept under names and taken up again."""

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.selection.selected import checked_name, selection_words
from plateviz.dashboard.session.selection_actions import SelectionActions, look_for_kept
from plateviz.dashboard.views.dialogs.dialog import dialog
from plateviz.dashboard.views.elements.markup import alert_words
from solver.data.subset import Subset
from solver.errors import InputError


class KeptSelectionsDialog(pn.viewable.Viewer):
    """A name for the selection, and the list of those that are kept, by others too."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the selection of the session of `navigation`."""
        super().__init__(**params)
        self._session, self._selection = navigation.session, navigation.session.selection
        self._actions = SelectionActions(navigation.session)
        # The name that somebody is asked whether to replace what is kept under it, and that.
        self._asked: tuple[str, Subset | None] | None = None
        # The words begin where the title does; a label on the border of a field has room above.
        wide = {"sizing_mode": "stretch_width", "size": "small", "margin": (10, 8)}
        self._name = pmui.TextInput(label="Name", placeholder="such as: lower left corner", **wide)
        self._keep = pmui.Button(label="Keep", margin=(10, 10))
        # The names are a person's text: a menu shows them as text.
        self._kept = pmui.Select(label="Kept selections", options=[], **wide)
        self._take_up = pmui.Button(label="Select again", variant="outlined", margin=(10, 4))
        self._forget = pmui.Button(label="Forget", variant="text", margin=(10, 4))
        self._words = pmui.Alert(
            object="", severity="info", sizing_mode="stretch_width", margin=(0, 8, 8, 8)
        )
        self._again = pmui.Row(self._kept, self._take_up, self._forget, margin=0)
        self._new = pmui.Row(self._name, self._keep, margin=0)
        self._dialog = dialog("Keep the selection", self._words, self._new, self._again, width="sm")
        self._keep.on_click(lambda _: self._keep_it())
        self._take_up.on_click(lambda _: self._actions.take_up(self._kept.value))
        self._forget.on_click(lambda _: self._actions.forget(self._kept.value))
        self._selection.param.watch(self._show, ["sources", "exposures", "detectors", "kept"])

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the dialog."""
        return self._dialog

    def open(self) -> None:
        """Open the dialog."""
        look_for_kept(self._session)
        self._asked = None
        self._name.value = self._selection.name_of_selected or ""
        self._show()
        self._dialog.open = True

    def _keep_it(self) -> None:
        try:
            name = checked_name(self._name.value_input or self._name.value)
            if self._asks_to_replace(name):
                return
            why = self._actions.keep(name)
            if why:
                self._say(f"It is kept in this session only: {why}.", "warning")
        except InputError as error:
            self._say(f"It was not kept: {error}.", "error")

    def _asks_to_replace(self, name: str) -> bool:
        """Ask once before what is kept under a name is lost, which may be another person's."""
        selected, there = self._selection.selected, self._selection.kept.get(name)
        before, self._asked = self._asked, (name, there)
        if not selected or there is None or there == selected or before == self._asked:
            return False
        self._say(
            f"This name has another selection: {selection_words(there)}. Press Keep again to "
            "replace it.",
            "warning",
        )
        return True

    def _show(self, *_: object) -> None:
        self._asked = None
        selected, kept = self._selection.selected, self._selection.kept
        name = self._selection.name_of_selected
        options = {f"{one} ({selection_words(items)})": one for one, items in kept.items()}
        chosen = name or (self._kept.value if self._kept.value in kept else next(iter(kept), None))
        self._kept.param.update(options=options, value=chosen)
        self._again.visible, self._new.visible = bool(kept), bool(selected)
        if not selected:
            self._say("Nothing is selected.")
        elif name is None:
            self._say(f"Selected: {selection_words(selected)}.")
        else:
            self._say(
                f"Kept under the name that is chosen below: {selection_words(selected)}.", "success"
            )

    def _say(self, text: str, severity: str = "info") -> None:
        self._words.param.update(object=alert_words(text), severity=severity)
