"""Remedies of what a verdict finds, tried on the solution on the screen, without Panel."""

from collections.abc import Iterable
from contextlib import suppress
from typing import NamedTuple

from plateviz.dashboard.session.session import Session
from plateviz.verdict.causes import Cause
from plateviz.verdict.remedy import remedied
from solver.data.settings import ENGINES, FitSettings
from solver.errors import InputError


class Remedy(NamedTuple):
    """A cause of a solution's flaws, and the settings with which it is remedied.

    Attributes
    ----------
    cause : of the verdict
    settings : None where no setting remedies it
    """

    cause: Cause
    settings: FitSettings | None


def remedies(settings: FitSettings, causes: Iterable[Cause]) -> list[Remedy]:
    """Return the causes, each with the settings to try; `settings` are those of the solution."""
    return [Remedy(cause, _settings(settings, cause)) for cause in causes]


def try_settings(session: Session, settings: FitSettings) -> None:
    """Request a solution beside the one on the screen.

    It is a what-if where a change of a control shows one, and a fit otherwise. One that is being
    computed goes on.
    """
    if session.awaits(settings):
        return
    choices = session.choices
    is_what_if = choices.what_if_at_once and settings.engine == ENGINES[0] and session.job is None
    choices.load(settings)
    if not is_what_if:
        session.refit()
    elif session.job is None:
        # The controls had these settings already, or the answer is there.
        session.ask_what_if()


def _settings(settings: FitSettings, cause: Cause) -> FitSettings | None:
    # The options may come from a file that another version has written.
    with suppress(InputError):
        return remedied(settings, cause.options)
    return None
