"""CodeDialog: a dialog with the code that makes what is on the screen."""

import re
from html import escape

import panel as pn

from plateviz.dashboard.navigation.navigation import WORKSPACES, Navigation
from plateviz.dashboard.saving.page_code import page_code
from plateviz.dashboard.views.dialogs.dialog import dialog, dialog_button
from plateviz.dashboard.views.elements.markup import markup_pane, paragraph, themed
from solver.errors import InputError

_OPTION = re.compile(r"(?<!\S)--?[a-z][\w-]*")
_TO_COPY = "A click selects the whole text."


class CodeDialog(pn.viewable.Viewer):
    """The command line and the Python that make the solution and the figures on the screen."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Begin closed."""
        super().__init__(**params)
        self._navigation, self._session = navigation, navigation.session
        self._text = markup_pane()
        self._dialog = dialog("Reproduce", self._text, width="md")
        self._session.param.watch(self._follow, ["shown", "other", "figure_of_both", "theme"])
        for one in (navigation.exploration, navigation.survey_exploration):
            one.param.watch(self._follow, list(one.param.values()))
        navigation.param.watch(self._follow, ["view", "run_name", "found", *WORKSPACES.values()])

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the dialog."""
        return self._dialog

    def open(self) -> None:
        """Open the dialog."""
        self._dialog.open = True
        self._follow()

    def _follow(self, *_: object) -> None:
        if not self._dialog.open:
            return
        try:
            code = page_code(self._navigation)
        except InputError as error:
            text = f"There is nothing to reproduce: {error}."
            self._text.object = paragraph(text, "empty", self._session.theme)
            return
        parts = {"Command line": code.command, "Python": code.python}
        blocks = "".join(
            f"<h3>{title}</h3><pre>{_unbroken(one)}</pre>" for title, one in parts.items()
        )
        markup = f"<div class='code'><p>{_unbroken(code.about)} {_TO_COPY}</p>{blocks}</div>"
        self._text.object = themed(markup, self._session.theme)


def _unbroken(text: str) -> str:
    """Return plain text as markup whose options, such as `--orbits`, stay in one line."""
    return _OPTION.sub(r"<span class='option'>\g<0></span>", escape(text))


def code_button(navigation: Navigation) -> list[pn.viewable.Viewable]:
    """Return the button that opens the dialog, and the place of the dialog."""
    return dialog_button("Reproduce", lambda: CodeDialog(navigation))
