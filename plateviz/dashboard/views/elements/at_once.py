"""Controls whose changes are taken at once."""

import panel as pn


def taken_at_once(*controls: pn.viewable.Viewable) -> None:
    """Let changes of controls be taken when they arrive.

    Panel waits 50 ms for further ones; a hand on a slider sends some ten a second.
    """
    for control in controls:
        control._debounce = 0  # type: ignore[attr-defined]
