"""NotableSourceLink: a line of text that opens the source with the most significant motion."""

from contextlib import suppress

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.tables.notable_source import notable_source
from solver.errors import InputError

_STYLE = {
    "textTransform": "none",
    "textAlign": "left",
    "fontSize": "13px",
    "letterSpacing": "normal",
}


class NotableSourceLink(pn.viewable.Viewer):
    """A link to the notable source of the run; hidden while no motions have been fitted."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the run of `navigation`."""
        super().__init__(**params)
        self._navigation = navigation
        self._source_id = ""
        self._button = pmui.Button(
            variant="text", icon="insights", size="small", margin=(4, 2), sx=_STYLE
        )
        self._button.on_click(lambda _: navigation.open_source(self._source_id))
        navigation.param.watch(self._read, ["run_name", "run_progress"])
        navigation.session.units.param.watch(self._read, "unit")
        self._read()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the link."""
        return self._button

    def _read(self, *_: object) -> None:
        run = self._navigation.run
        found = None
        # Where the motions cannot be read, the page of the run or the source says so.
        with suppress(InputError):
            found = None if run is None else notable_source(run.motions())
        self._button.visible = found is not None
        if found is not None:
            self._source_id = str(found.source_id)
            text = self._navigation.session.units.text(found.text)
            self._button.label = f"Most significant motion: source {found.source_id}, {text}"
