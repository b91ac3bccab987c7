"""A test of a run that finds something, to be put into words."""

from typing import NamedTuple

import pandas as pd

from plateviz.tables.run_diagnosis import RunDiagnosis, RunTests
from solver.results.diagnosis.test import Test


class RunCase(NamedTuple):
    """A test that finds something, and the run in which it does."""

    test: Test
    diagnosis: RunDiagnosis
    tables: RunTests
    motions: pd.DataFrame
