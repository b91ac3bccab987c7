"""Table of the tests that the verdict on a solution rests on, the most significant first."""

import pandas as pd

from plateviz.verdict.verdict import orbit_verdict
from solver.data.result import FitResult


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
    is more than chance over all tests), and in all rows `total`, the number of tests, and
    `total_found`, of those that are more than chance
    """
    tests = pd.DataFrame(list(orbit_verdict(result).tests))
    ranked = tests.sort_values("sigma", ascending=False, kind="stable").head(most)
    return ranked.assign(
        size_nm=ranked["size_nm"].astype(float),
        row=range(len(ranked)),
        total=len(tests),
        total_found=int(tests["is_found"].sum()),
    ).reset_index(drop=True)
