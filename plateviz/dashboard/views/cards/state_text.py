"""The state of the solution on the screen in words: its reasons above, in short on the cards."""

from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.stage import Stage

_WHAT_TO_DO = "Change the settings on the left and press Fit, or choose another orbit."
_BEGUN = "The first solution is being computed."


def missing_text(session: Session) -> str:
    """Return why there is no solution yet, and what to do about it."""
    if session.stage is Stage.FAILED:
        return f"There is no solution: {_sentence(session.message)} {_WHAT_TO_DO}"
    return _BEGUN


def empty_text(session: Session) -> str:
    """Return that there is no solution yet, on a card below the reason."""
    return "There is no solution." if session.stage is Stage.FAILED else _BEGUN


def outdated_text(session: Session) -> str:
    """Return why the solution on the screen is not the requested one; empty if it is.

    Of a what-if that has only begun nothing is said: what is on the screen would move twice, each
    time that a slider moves.
    """
    if session.shown is None:
        return ""
    if session.stage is Stage.STALE and not session.is_brief:
        so_far = f": {session.message}" if session.message else ""
        return f"Another solution is being computed{so_far}. This is still the last one."
    if session.stage is Stage.FAILED:
        return f"The last request has no solution, and this one stays: {_sentence(session.message)}"
    return ""


def _sentence(message: str) -> str:
    return message if not message or message.endswith((".", "!", "?")) else f"{message}."
