"""Runs that begin, and the run on the screen that is removed, while nobody does anything."""

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.plots.workspace import SurveyWorkspace


def look_for_run(navigation: Navigation) -> None:
    """Offer runs that have begun, and say whether that on the screen is gone.

    The first run of a survey is shown. It costs a look at two directories; where two runs are
    compared, the other one is looked at, too.
    """
    runs = navigation.known_runs
    if runs.look() and runs.first is not None:
        navigation.param["run_name"].objects = list(runs)
        navigation.run_name = navigation.run_name or runs.first.name
    run = navigation.run
    navigation.session.loss = "" if run is None or run.is_there() else _words(run.name)
    if navigation.workspace is SurveyWorkspace.COMPARE:
        navigation.session.run_comparison.look(navigation.run_name, runs)


def _words(run: str) -> str:
    return (
        f"The run {run} is not on the disk any more. What was read before stays on this page; "
        "what was not cannot be shown."
    )
