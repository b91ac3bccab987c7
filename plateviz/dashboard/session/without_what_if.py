"""What to do where a change of the settings of the next fit shows no what-if, in words."""

from plateviz.dashboard.session.session import Session
from solver.data.settings import ENGINES


def what_to_do(session: Session, engine: str) -> str:
    """Return what to do for the settings of the controls to take effect; empty if they do at once.

    Parameters
    ----------
    engine : of the settings of the controls
    """
    if engine != ENGINES[0]:
        return f"press Fit: a solution with the engine {engine} has no what-if"
    if not session.choices.what_if_at_once:
        return "press Fit, or switch on What-if at every change"
    if session.is_fitting:
        return "press Fit, which begins anew: the fit that runs has been asked for without it"
    return ""
