"""Table of the tests that the verdict on a solution rests on, the most significant first."""

import numpy as np
import pandas as pd

from plateviz.verdict.verdict import orbit_verdict
from solver.data.result import FitResult
from solver.results.diagnosis.rate import sigmas
from solver.results.diagnosis.table import CARE_RATE


def solution_tests(result: FitResult, *, most: int = 16) -> pd.DataFrame:
    """Return the tests of a solution with the smallest probability by chance.

    Parameters
    ----------
    result : the fit
    most : number of rows

    Returns
    -------
    A row per test, the most significant first: `row`, `name`, `statistic`, with `expected` and
    `scatter` in good solutions, `sigma` (its chance as the distance of a normal value), `size_nm`
    (rms displacement of its pattern on the focal plane; NaN if it has none), `is_found` (whether it
    is more than chance over all tests), and in all rows `total`, the number of tests,
    `total_found`, of those that are more than chance, and `limit`, the significance beyond which
    they are
    """
    tests = pd.DataFrame(list(orbit_verdict(result).tests))
    ranked = tests.sort_values("sigma", ascending=False, kind="stable").head(most)
    total, found = len(tests), int(tests["is_found"].sum())
    return ranked.assign(
        size_nm=ranked["size_nm"].astype(float),
        row=range(len(ranked)),
        total=total,
        total_found=found,
        # The limit of Benjamini and Hochberg falls with each discovery.
        limit=sigmas(float(np.log(CARE_RATE * max(found, 1) / total))),
    ).reset_index(drop=True)
