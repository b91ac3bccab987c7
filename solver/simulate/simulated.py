"""How a survey on disk was simulated, for what is compared with the truth."""

from pathlib import Path

from solver.errors import InputError
from solver.io.survey import TRUTH_FILE, has_survey_table
from solver.io.survey_header import read_header, section
from solver.simulate.settings import SurveySettings


def simulation_of(directory: Path) -> SurveySettings | None:
    """Return the settings with which a survey was simulated.

    Returns
    -------
    None for a survey without a truth, of measurements that were not simulated, or of another
    version of the simulator.

    Raises
    ------
    InputError
        If the directory is not a complete survey.
    """
    directory = Path(directory)
    settings = section(read_header(directory), "settings")
    if not settings or not has_survey_table(directory, TRUTH_FILE):
        return None
    try:
        return SurveySettings.from_dict(settings)
    except InputError:
        return None
