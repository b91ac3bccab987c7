"""The paper's survey: simulated and fitted as needed, and its numbers compared."""

from pathlib import Path

import pandas as pd

from plateviz.cache import keep_compilations
from plateviz.cli.survey_progress import fit_and_report, require_all
from plateviz.runs.run import Run, open_run
from plateviz.runs.run_directory import RunDirectory
from plateviz.solving.origin import SurveyFolder
from plateviz.solving.progress import reporting
from plateviz.tables.reproduction import OFTEN, SurveyFigures, reproduction
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.disk import writing
from solver.io.survey_header import HEADER
from solver.simulate.settings import SurveySettings
from solver.units import RAD_PER_MAS


def reproduced(survey: Path, run: str, workers: int | None) -> pd.DataFrame:
    """Return `tables.reproduction` of a run; simulate the survey and fit orbits as needed.

    Raises
    ------
    InputError
        If the directory holds other files, or the run has other settings.
    FitError
        If orbits failed.
    """
    if not (survey / HEADER).is_file():
        _simulate(survey)
    if not RunDirectory(survey, run).is_complete:
        require_all(fit_and_report(survey, run, FitSettings(), workers=workers))
    return reproduction(figures_of(open_run(survey, run)))


def figures_of(run: Run) -> SurveyFigures:
    """Return the tables for the paper's numbers; InputError if the run has no fitted orbit."""
    errors = run.errors_by_count()
    if errors is None:
        raise InputError(f"{run.directory}: expected a run with fitted orbits, found none")
    instrument = SurveyFolder(str(run.survey)).read_instrument()
    pitch = instrument.detectors[0].pitch_x_um
    scale = pitch / instrument.focal_length_um / RAD_PER_MAS
    return SurveyFigures(run.orbits(), run.motions(), errors, run.classes(OFTEN), scale)


def _simulate(survey: Path) -> None:
    keep_compilations()
    from solver.simulate.survey import simulate_survey

    with writing(survey.parent, "to make the folder"):
        survey.parent.mkdir(parents=True, exist_ok=True)
    with reporting("simulating the paper's survey") as reporter:
        simulate_survey(survey, SurveySettings(), progress=reporter.step)
