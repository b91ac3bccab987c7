"""Stage: the state of the solution on the screen of a session."""

from enum import Enum


class Stage(Enum):
    """State of the solution on the screen."""

    LOADING = "the first solution is being computed"
    READY = "the solution is the requested one"
    STALE = "another solution is being computed"
    FAILED = "the last request failed"
