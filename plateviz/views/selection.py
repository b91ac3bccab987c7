"""SelectionView: which exposures and which detector the page shows."""

import panel as pn
import panel_material_ui as pmui

from plateviz.session import Session


class SelectionView(pn.viewable.Viewer):
    """Controls of the session's selection."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        selection = session.selection
        wide = {"sizing_mode": "stretch_width", "size": "small", "description": ""}
        field = pmui.Select.from_param(selection.param.field, label="Field", **wide)
        detector = pmui.Select.from_param(selection.param.detector, label="Detector", **wide)
        plates = pmui.IntRangeSlider.from_param(
            selection.param.plates,
            label="Exposures of the field",
            description="",
            sizing_mode="stretch_width",
        )
        self._column = pmui.Column(field, plates, detector, sizing_mode="stretch_width", margin=0)
        if len(session.workbench.orbits) > 1:
            orbit = pmui.Select(
                label="Orbit", options=session.workbench.orbits, value=selection.orbit, **wide
            )
            orbit.param.watch(lambda event: session.show_orbit(event.new), "value")
            self._column.insert(0, orbit)

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the controls."""
        return self._column
