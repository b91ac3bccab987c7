"""Input tables of the figures of a fitted survey, read from its files."""

from plateviz.runs.queries import SurveyRun
from plateviz.tables.survey_tables import SurveyTables
from solver.data.schema import CATALOGUE, TRUTH
from solver.io.survey import REFERENCE, TRUTH_FILE, read_header, read_survey_table


def survey_tables(run: SurveyRun) -> SurveyTables:
    """Return the tables of a run and of its survey.

    Raises
    ------
    InputError
        If a file of the survey cannot be read.
    """
    truth = run.survey / TRUTH_FILE
    settings = read_header(run.survey).get("settings")
    where = settings if isinstance(settings, dict) else {}
    sides = where.get("field_l_deg"), where.get("field_b_deg")
    return SurveyTables(
        orbits=run.orbits(),
        motions=run.motions(),
        catalogue=read_survey_table(run.survey / REFERENCE, CATALOGUE),
        truth=read_survey_table(truth, TRUTH) if truth.is_file() else None,
        errors_by_count=run.errors_by_count(),
        area=tuple(map(tuple, sides)) if all(sides) else None,  # type: ignore[arg-type]
        target=tuple(where["target_deg"]) if "target_deg" in where else None,  # type: ignore[arg-type]
    )
