"""Numbers in sentences."""

import numpy as np
import pytest

from plateviz.tables.rounded import rounded


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0463, 2, "0.046"),
        (1.0, 2, "1"),
        (np.float64(146.2), 2, "150"),
        (12345.0, 3, "12,300"),
        (1.23e-7, 2, "0.00000012"),
        (-0.5, 2, "-0.5"),
        (0.0, 2, "0"),
        (float("nan"), 2, "nan"),
        (float("inf"), 3, "inf"),
    ],
)
def test_number_has_a_few_digits_and_no_exponent(value, digits, text):
    assert rounded(value, digits) == text
