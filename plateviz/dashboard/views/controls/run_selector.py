"""Control that selects the run of the survey on the screen."""

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import Navigation


def run_selector(navigation: Navigation) -> list[pn.viewable.Viewable]:
    """Return the control that selects a run, which is seen once there is one."""
    selector = pmui.Select.from_param(
        navigation.param.run_name,
        label="Run",
        description="",
        size="small",
        sizing_mode="stretch_width",
        visible=navigation.run is not None,
    )

    def show(*_: object) -> None:
        selector.visible = navigation.run is not None

    navigation.param.watch(show, "run_name")
    return [selector]
