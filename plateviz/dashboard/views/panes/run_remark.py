"""RunRemark: a line on the page of a source that says so where its run is not good."""

from concurrent.futures import Future
from contextlib import suppress

import panel as pn

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.view import View
from plateviz.dashboard.views.elements.markup import markup_pane, paragraph
from plateviz.solving.run_reader import ReadRun
from solver.errors import InputError


class RunRemark(pn.viewable.Viewer):
    """The headline of the verdict on the run; empty where it is good, or not yet known.

    A motion may scatter as its noise predicts, and be wrong with all others of its run.
    """

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the run of `navigation`, which is read while a source is on the screen."""
        super().__init__(**params)
        self._navigation = navigation
        self._pane = markup_pane()
        self._being_read: Future[ReadRun] | None = None
        self._headline = ""
        navigation.param.watch(self._read, ["view", "run_name", "run_progress", "found"])
        navigation.session.param.watch(self._show, "theme")
        self._read()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the line."""
        return self._pane

    @property
    def is_pending(self) -> bool:
        """Whether another thread reads and judges the run."""
        return self._being_read is not None

    def look(self) -> None:
        """Take the verdict once it is there; called again and again until then."""
        read = self._being_read
        if read is None or not read.done():
            return
        self._being_read = None
        try:
            verdict = read.result().verdict
        except InputError:
            # The views of the run say why.
            return
        self._headline = "" if verdict.state == "good" else verdict.headline
        self._show()

    def _read(self, *_: object) -> None:
        navigation = self._navigation
        self._headline, self._being_read = "", None
        is_shown = navigation.view is View.SOURCE and navigation.found is not None
        if is_shown and navigation.run is not None:
            # If the run is gone, `navigation` says so.
            with suppress(InputError):
                self._being_read = navigation.session.store.run_reader.read(navigation.run)
        self.look()
        self._show()

    def _show(self, *_: object) -> None:
        theme, words = self._navigation.session.theme, self._headline
        if words:
            words = f"{words} What speaks against it stands on the Survey page."
        self._pane.object = paragraph(words, "outdated", theme) if words else ""
