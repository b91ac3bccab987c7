"""What a page says where its run cannot be read."""

from solver.errors import InputError

RELOAD = "Reload the page once the run is there again."


def unread_run(error: InputError, *, has_before: bool = False) -> str:
    """Return why a run cannot be read, and what to do about it.

    Parameters
    ----------
    has_before : whether the page keeps what it has read before
    """
    stays = "What was read before stays. " if has_before else ""
    return f"The run cannot be read: {error}. {stays}{RELOAD}"
