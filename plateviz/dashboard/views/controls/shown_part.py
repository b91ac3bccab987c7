"""ShownPartView: controls for the orbit, exposures and detector on the screen."""

from typing import Any

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.views.elements.at_once import taken_at_once


class ShownPartView(pn.viewable.Viewer):
    """Controls of what a session shows of which orbit."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the session of `navigation`."""
        super().__init__(**params)
        part = navigation.session.shown_part
        wide = {"sizing_mode": "stretch_width", "size": "small", "description": ""}
        field = pmui.Select.from_param(part.param.field, label="Field", **wide)
        detector = pmui.Select.from_param(part.param.detector, label="Detector", **wide)
        plates = pmui.IntRangeSlider.from_param(
            part.param.plates,
            label="Exposures of the field",
            description="",
            sizing_mode="stretch_width",
        )
        taken_at_once(field, plates, detector)
        self._column = pmui.Column(field, plates, detector, sizing_mode="stretch_width", margin=0)
        self._column.insert(0, _orbit_control(navigation, **wide))

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the controls."""
        return self._column


def _orbit_control(navigation: Navigation, **style: Any) -> pmui.Select:  # noqa: ANN401
    """Return the control of the orbit, which is seen if there are several."""
    part = navigation.session.shown_part

    def offered() -> dict[str, Any]:
        orbits = list(part.param["orbit"].objects)
        return {"options": orbits, "visible": len(orbits) > 1}

    orbit = pmui.Select(label="Orbit", value=part.orbit, **offered(), **style)

    def choose(event: object) -> None:
        if event.new != part.orbit:  # type: ignore[attr-defined]
            # What follows from it is sent as one message.
            with pn.io.hold():
                navigation.choose_orbit(event.new)  # type: ignore[attr-defined]
                # An orbit that cannot be read is not selected.
                orbit.value = part.orbit

    orbit.param.watch(choose, "value")
    part.param.watch(lambda _: orbit.param.update(value=part.orbit), "orbit")
    # Orbits may be added to the survey while it is shown.
    part.param.watch(lambda _: orbit.param.update(**offered()), "orbit", what="objects")
    return orbit
