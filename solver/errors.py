"""Exceptions: invalid input, cancelled work and failed fits."""


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


class DistrustError(FitError):
    """A fit that converged to a solution that should not be trusted."""
