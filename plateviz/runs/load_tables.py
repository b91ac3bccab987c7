"""Input tables of the figures of a fitted survey, read from its files."""

import math
from pathlib import Path

import pandas as pd

from plateviz.runs.run import Run
from plateviz.runs.run_tables import RunTables, read_run_tables
from plateviz.tables.survey_tables import SurveyTables
from plateviz.verdict.run_changes import ComparedRun
from plateviz.verdict.verdict import Verdict
from solver.data.schema import CATALOGUE, TRUTH
from solver.errors import InputError
from solver.io.settings import parse_settings
from solver.io.survey import REFERENCE, TRUTH_FILE, has_survey_table, read_survey_table
from solver.io.survey_header import HEADER, read_header, section


def survey_tables(run: Run, read: RunTables | None = None) -> SurveyTables:
    """Return the tables of a run and of its survey.

    Parameters
    ----------
    read : tables of the run that were read before; None to read them

    Raises
    ------
    InputError
        If a file of the survey cannot be read.
    """
    orbits, motions, tests = read or read_run_tables(run)
    sides = (_pair(run.survey, "field_l_deg"), _pair(run.survey, "field_b_deg"))
    return SurveyTables(
        orbits=orbits,
        motions=motions,
        tests=tests,
        catalogue=read_survey_table(run.survey / REFERENCE, CATALOGUE),
        truth=_truth(run.survey),
        errors_by_count=run.errors_by_count(),
        area=None if None in sides else sides,  # type: ignore[arg-type]
        target=_pair(run.survey, "target_deg"),
    )


def compared_run(run: Run, read: RunTables, verdict: Verdict) -> ComparedRun:
    """Return what of a run is compared with another one.

    Parameters
    ----------
    read : tables of the run
    verdict : on it

    Raises
    ------
    InputError
        If its settings cannot be read.
    """
    settings = parse_settings(run.header().get("settings"), f"run {run.name}")
    return ComparedRun(run.name, settings, *read, verdict)


def require_same_catalogue(a: Run, b: Run) -> None:
    """Raise InputError if the catalogue was another when one of two runs was made.

    The motions of a run are relative to its catalogue.
    """
    found = [section(dict(run.header()), "inputs").get(REFERENCE) for run in (a, b)]
    if None not in found and found[0] != found[1]:
        raise InputError(
            f"runs {a.name!r} and {b.name!r}: expected fits with the same catalogue, found that "
            f"{REFERENCE} has changed between them; fit the orbits again in another run"
        )


def _pair(survey: Path, name: str) -> tuple[float, float] | None:
    """Return two numbers of the settings of a survey, or None."""
    found = section(read_header(survey), "settings").get(name)
    if found is None:
        return None
    numbers = found if isinstance(found, list) else []
    finite = [isinstance(one, int | float) and math.isfinite(one) for one in numbers]
    if finite != [True, True]:
        raise InputError(f"{survey / HEADER}: expected {name} to be two numbers, found {found!r}")
    return numbers[0], numbers[1]


def _truth(survey: Path) -> pd.DataFrame | None:
    if not has_survey_table(survey, TRUTH_FILE):
        return None
    return read_survey_table(survey / TRUTH_FILE, TRUTH)
