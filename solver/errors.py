"""The one exception that means "your input, not our code"."""


class InputError(ValueError):
    """Wrong input, described in one message for the person who can mend it.

    The message names the file, the HDU or column, what was expected and what was found.
    The command line prints it and exits with code 2; a notebook shows it without a traceback.
    """

    def _render_traceback_(self) -> list[str]:
        # IPython asks for what to show: the way through our code helps nobody to mend the input.
        return [f"{type(self).__name__}: {self}"]


class CancelledError(RuntimeError):
    """The person who asked for the work asked for it to stop; nothing was changed."""


class FitError(RuntimeError):
    """A fit that ended with nothing to show: the message says why."""
