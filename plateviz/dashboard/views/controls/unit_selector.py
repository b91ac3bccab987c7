"""Control that selects the unit of angles in all figures, texts and tables."""

import panel_material_ui as pmui

from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.units import NAMES


def unit_selector(session: Session) -> pmui.Select:
    """Return the control."""
    units = session.units
    selector = pmui.Select(
        label="Unit of angles",
        options=dict(NAMES),
        value=units.unit,
        size="small",
        sizing_mode="stretch_width",
    )
    selector.param.watch(lambda event: units.param.update(unit=event.new), "value")
    units.param.watch(lambda event: selector.param.update(value=event.new), "unit")
    return selector
