"""SelectionBar: what is selected, and what can be done with it."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import WORKSPACES, Navigation
from plateviz.dashboard.saving.downloads import Done, Later
from plateviz.dashboard.saving.same_machine import is_same_machine
from plateviz.dashboard.saving.selected_tables import (
    is_of_orbit,
    selected_places,
    selected_tables,
    selection_name,
)
from plateviz.dashboard.saving.table_sender import TableSender
from plateviz.dashboard.selection.selected import selection_words
from plateviz.dashboard.session.selection_actions import SelectionActions, look_for_kept
from plateviz.dashboard.views.dialogs.kept_selections import KeptSelectionsDialog
from plateviz.dashboard.views.dialogs.selection_list import SelectionList
from plateviz.dashboard.views.elements.bar_style import IN_BAR
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import table_choices
from solver.data.subset import KINDS, Subset
from solver.errors import InputError

_WORDS: Mapping[str, Any] = MappingProxyType(
    {"variant": "body2", "margin": (0, 8, 0, 8), "align": "center", "sx": IN_BAR}
)


class SelectionBar(pn.viewable.Viewer):
    """A line of words and buttons; empty while nothing is selected and nothing kept.

    Attributes
    ----------
    windows : place of the windows; elsewhere on the page, since a window has the colours of what
        it is in
    """

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the selection of the session of `navigation`."""
        super().__init__(**params)
        self._navigation, self._session = navigation, navigation.session
        self._actions = SelectionActions(navigation.session)
        look_for_kept(self._session)
        # Apart from the title of the page, whatever it begins with.
        self._row = pmui.Row(margin=(0, 0, 0, 16), sx={"alignItems": "center"})
        self.windows = pmui.Column(margin=0)
        self._parts: list[pn.viewable.Viewable] = []
        self._is_here, self._sender = is_read_here(), TableSender()
        if pn.state.curdoc is not None:
            pn.state.on_session_destroyed(lambda _: self._sender.close())
        self._session.selection.param.watch(self._show, [*KINDS, "kept"])
        self._session.choices.param.watch(self._show, "exclusions")
        self._session.param.watch(self._show, ["shown", "theme", "remark"])
        navigation.param.watch(self._show, "view")
        self._session.selection.param.watch(self._forget_remark, [*KINDS])
        navigation.param.watch(self._forget_remark, ["view", *WORKSPACES.values()])
        self._show()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the line."""
        return self._row

    def _make(self) -> None:
        actions = self._actions
        self._words = pmui.Typography("", **_WORDS)
        self._list, self._kept = (
            SelectionList(self._navigation),
            KeptSelectionsDialog(self._navigation),
        )
        self._open = self._button("Open", self._open_source)
        self._leave_out = self._button("Leave out of the fit", actions.leave_out)
        self._put_back = self._button("Put back into the fit", actions.put_back)
        choices = table_choices(
            partial(selection_name, self._navigation), partial(selected_tables, self._navigation)
        )
        self._save = SaveButton("selection", choices, place="bar")
        self._send_button = SaveButton(
            "selected sources to TOPCAT or DS9",
            {"SAMP": self._send},
            place="bar",
            text="Send",
            done="sent",
        )
        self._invert = self._button("Invert", actions.invert)
        self._keep = self._button("Keep", self._kept.open)
        self._parts = [
            self._words,
            self._button("List", self._list.open),
            self._open,
            self._leave_out,
            self._put_back,
            self._invert,
            self._save,
            self._send_button,
            self._keep,
            self._button("Clear", actions.clear),
        ]
        self.windows[:] = [self._list, self._kept]

    def _button(self, label: str, act: Callable[[], None]) -> pmui.Button:
        button = pmui.Button(label=label, variant="text", size="small", margin=(0, 2), sx=IN_BAR)
        button.on_click(lambda _: act())
        return button

    def _show(self, *_: object) -> None:
        session, selected = self._session, self._session.selection.selected
        if session.remark and not selected:
            self._row[:] = [pmui.Typography(session.remark, **_WORDS)]
            return
        if not selected and not session.selection.kept:
            self._row.clear()
            return
        if not self._parts:
            self._make()
        is_orbit, is_left_out = is_of_orbit(self._navigation), self._actions.is_left_out
        in_orbit = self._actions.in_orbit if is_orbit else None
        self._words.object = session.remark or words(selected, in_orbit)
        is_source = selected.kinds == ["sources"] and len(selected.sources) == 1
        self._open.visible = is_source and self._navigation.run is not None
        self._leave_out.visible = is_orbit and not is_left_out
        self._put_back.visible = is_orbit and is_left_out
        self._invert.visible = is_orbit
        self._send_button.visible = bool(selected.sources)
        self._keep.label = "Keep" if selected else "Kept selections"
        self._save.theme = self._send_button.theme = session.theme
        self._list.show()
        shown = self._parts if selected else [self._keep]
        if list(self._row) != shown:
            self._row[:] = shown

    def _forget_remark(self, *_: object) -> None:
        self._session.remark = ""

    def _open_source(self) -> None:
        (source,) = self._session.selection.sources
        self._navigation.open_source(str(source))

    def _send(self) -> Later:
        """Return the sending of the selected sources, as they are now."""
        if not self._is_here:
            raise InputError(
                "programs are reached where plateviz runs only, and this page is read on another "
                "machine or through a proxy; Save, VOTable is a file for them"
            )
        make, name = selected_places(self._navigation), selection_name(self._navigation)
        return Later(lambda _: Done(self._sender.send(make(), name)))


def words(selected: Subset, in_orbit: Subset | None) -> str:
    """Return the selection in words.

    Parameters
    ----------
    selected : the selection
    in_orbit : the part that the orbit on the screen has measured; None if no orbit is shown
    """
    text = f"{selection_words(selected)} selected"
    if in_orbit is None or in_orbit == selected:
        return text
    return (
        f"{text}, {selection_words(in_orbit)} in this orbit"
        if in_orbit
        else f"{text}, none in this orbit"
    )


def is_read_here() -> bool:
    """Return whether the page of this session is read on the machine that serves it."""
    context: Any = getattr(pn.state.curdoc, "session_context", None)
    if context is None or context.request is None:
        return False
    request = context.request
    return is_same_machine(request.remote_ip or "", dict(request.headers))
