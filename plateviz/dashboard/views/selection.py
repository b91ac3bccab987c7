"""SelectionView: controls for the orbit, exposures and detector on the screen."""

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation import Navigation


class SelectionView(pn.viewable.Viewer):
    """Controls of the session's selection."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the session of `navigation`."""
        super().__init__(**params)
        session = navigation.session
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
        for control in (field, plates, detector):
            # Panel waits 50 ms for further changes; a hand on the slider sends some ten a second.
            control._debounce = 0  # type: ignore[misc]
        self._column = pmui.Column(field, plates, detector, sizing_mode="stretch_width", margin=0)
        if len(session.store.orbits) > 1:
            orbit = pmui.Select(
                label="Orbit", options=session.store.orbits, value=selection.orbit, **wide
            )
            self._column.insert(0, orbit)

            def choose(event: object) -> None:
                if event.new != selection.orbit:  # type: ignore[attr-defined]
                    navigation.choose_orbit(event.new)  # type: ignore[attr-defined]
                    # An orbit that cannot be read is not selected.
                    orbit.value = selection.orbit

            orbit.param.watch(choose, "value")
            selection.param.watch(lambda _: orbit.param.update(value=selection.orbit), "orbit")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the controls."""
        return self._column
