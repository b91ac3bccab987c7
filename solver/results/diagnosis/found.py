"""One cause of a solution's flaws, as the tests find it."""

from typing import NamedTuple

import numpy as np

from solver.results.diagnosis.table import CARE_RATE, Diagnosis
from solver.results.diagnosis.test import Test

# Causes whose gains differ by less are nearly as likely: at most ninety times, three sigmas.
CLOSE = 9.0


class Found(NamedTuple):
    """A cause that the tests point to.

    Attributes
    ----------
    test : the test that says so, after the causes before it
    gain : how much more likely the cause makes the residuals (`solver.results.diagnosis.gains`)
    items : indices of exposures, or ids of sources, that it is about; may be empty
    size : rms displacement, um, or another amplitude of the cause
    """

    test: Test
    gain: float
    items: tuple[int, ...] = ()
    size: float = float("nan")


def limit_of(diagnosis: Diagnosis) -> float:
    """Return the logarithm of the chance below which a single test is named as a cause."""
    return float(np.log(CARE_RATE / len(diagnosis.tests)))
