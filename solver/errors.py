"""Exceptions: invalid input, cancelled work and failed fits."""

from collections.abc import Mapping
from typing import Any, NamedTuple


class InputError(ValueError):
    """Invalid input, described in one message for the user.

    The message names the file, the HDU or column, what was expected and what was found.
    The command line prints it and exits with code 2; a notebook shows it without a traceback.
    """

    def _render_traceback_(self) -> list[str]:
        # IPython calls this for the text to show; a traceback would not help to correct the input.
        return [f"{type(self).__name__}: {self}"]


class DiskError(InputError):
    """A disk or a folder that takes no file: full, read-only, without permission.

    It is not about one orbit: what it stops does not go on with the next one.
    """


class CancelledError(RuntimeError):
    """The user cancelled the work; nothing was changed."""


class FitError(RuntimeError):
    """A fit that has no result; the message gives the reason."""


class LikelyCause(NamedTuple):
    """What most likely left a fit without a solution.

    Attributes
    ----------
    name : short and unique, for programs
    title : the cause as a clause
    words : the evidence, as a sentence without its full stop
    action : what to do
    is_misfit : whether the evidence is the size of the residuals
    """

    name: str
    title: str
    words: str
    action: str
    is_misfit: bool = False

    def sentence(self) -> str:
        """Return the evidence and what to do as text."""
        return f"{self.words}: {self.action}."


class NoSolutionError(FitError):
    """A fit that ended where no uncertainties exist, and so without tables.

    Attributes
    ----------
    summary : what is known of it; keys as in `solver.results.summary`
    chi2 : of the measurements at its last point; perhaps no number
    cause : what is likely the matter
    """

    def __init__(
        self, message: str, summary: Mapping[str, Any], chi2: float, cause: LikelyCause
    ) -> None:
        """Take the message for the user, and the attributes."""
        # All of them, so that it can be pickled.
        super().__init__(message, summary, chi2, cause)
        self.summary, self.chi2, self.cause = summary, chi2, cause

    def __str__(self) -> str:
        """Return the message."""
        return str(self.args[0])


class DistrustError(FitError):
    """A fit that converged to a solution that should not be trusted."""
