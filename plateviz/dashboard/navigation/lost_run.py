"""Runs that begin, and the run on the screen that is removed or replaced, while nobody acts."""

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.runs.run import Run


def look_for_run(navigation: Navigation) -> None:
    """Offer runs that have begun, and say whether that on the screen is gone or another one.

    The first run of a survey is shown. It costs a look at two directories and a small file; where
    two runs are compared, the other one is looked at, too.
    """
    runs = navigation.known_runs
    if runs.look() and runs.first is not None:
        navigation.param["run_name"].objects = list(runs)
        navigation.run_name = navigation.run_name or runs.first.name
    run, before = navigation.run, navigation.session.loss
    navigation.session.loss = "" if run is None else _loss(run)
    if before and not navigation.session.loss:
        # What could not be read while it was gone is read now.
        navigation.survey_exploration.returns += 1
    if navigation.workspace is SurveyWorkspace.COMPARE:
        navigation.session.run_comparison.look(navigation.run_name, runs)


def _loss(run: Run) -> str:
    """Return what has become of a run; empty if it is as it was."""
    if not run.is_there():
        return (
            f"The run {run.name} is not on the disk any more. What was read before stays on this "
            "page; what was not cannot be shown."
        )
    if run.is_replaced():
        return (
            f"Another run has the name {run.name} by now. This page has parts of both: "
            "reload it to see the new one."
        )
    return ""
