"""Jobs of the solver process on a whole survey: to simulate one, and to fit its orbits.

A request is the JSON object of `plateviz.solving.solver_process`.
"""

from collections.abc import Callable
from pathlib import Path

from plateviz.solving.fitters import Request
from plateviz.solving.preparation import Preparation
from solver.data.settings import FitSettings
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

Progress = Callable[..., None]


def simulate(request: Request, progress: Progress) -> Preparation:
    """Write the survey of a request; errors as of `simulate_survey`."""
    settings = SurveySettings.from_dict(request["settings"])
    catalogue = request.get("catalogue")
    simulate_survey(
        Path(request["directory"]),
        settings,
        catalogue=None if catalogue is None else Path(catalogue),
        progress=lambda done, total: progress(stage="simulating", done=done, total=total),
    )
    return Preparation()


def fit_run(request: Request, progress: Progress) -> Preparation:
    """Fit the orbits of a request in a run; errors as of `fit_survey`."""
    # Imported here since Dask takes half a second to import.
    from plateviz.runs.fit_survey import fit_survey

    fit_survey(
        Path(request["directory"]),
        request["run"],
        FitSettings.from_dict(request["settings"]),
        request["orbits"],
        request["workers"],
        progress=lambda now: progress(stage="fitting orbits", done=now.done, total=now.total),
    )
    return Preparation()
