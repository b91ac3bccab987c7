"""What a page says where its run cannot be read."""

from solver.errors import InputError

RELOAD = "Reload the page once the run is there again."
STAYS = "What was read before stays."


def unread_run(error: InputError) -> str:
    """Return why a run cannot be read, and what to do about it."""
    return f"The run cannot be read: {error}. {RELOAD}"
