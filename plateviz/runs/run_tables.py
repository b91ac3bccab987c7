"""Reading of the tables from which a run is tested, and of its verdict."""

from typing import NamedTuple

import pandas as pd

from plateviz.runs.run import Run
from plateviz.tables.run_diagnosis import RunTests
from plateviz.verdict.run_verdict import run_verdict
from plateviz.verdict.verdict import Verdict
from solver.data.columns import Table
from solver.data.run_schema import RUN_TABLES


class RunTables(NamedTuple):
    """The tables from which a run is judged.

    Attributes
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`
    tests : from which the run as a whole is tested
    """

    orbits: pd.DataFrame
    motions: pd.DataFrame
    tests: RunTests


def read_run_tests(run: Run) -> RunTests:
    """Return the tables of the tests of a run; no rows until it is gathered, or in old runs.

    Raises
    ------
    InputError
        If a table is damaged.
    """
    return RunTests(*(_read(run, table) for table in RUN_TABLES))


def read_run_tables(run: Run) -> RunTables:
    """Return the tables from which a run is judged; raises as `read_run_tests`."""
    return RunTables(run.orbits(), run.motions(), read_run_tests(run))


def read_run_verdict(run: Run) -> Verdict:
    """Return the verdict on a run; raises as `read_run_tests`."""
    return run_verdict(*read_run_tables(run))


def _read(run: Run, table: Table) -> pd.DataFrame:
    found = run.test_table(f"{table.name}.parquet")
    return pd.DataFrame(columns=table.names) if found is None else found
