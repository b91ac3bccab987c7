"""What to say when the run on the screen is removed while nobody does anything."""

from plateviz.dashboard.navigation import Navigation


def look_for_run(navigation: Navigation) -> None:
    """Say on the page whether the run on the screen is gone; costs one look at a directory."""
    run = navigation.run
    navigation.session.loss = "" if run is None or run.is_there() else _words(run.name)


def _words(run: str) -> str:
    return (
        f"The run {run} is not on the disk any more. What was read before stays on this page; "
        "what was not cannot be shown."
    )
