"""Numbers in sentences."""

import numpy as np
import pytest

from plateviz.tables.rounded import rounded, with_error, with_minus_signs


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0463, 2, "0.046"),
        (1.0, 2, "1"),
        (np.float64(146.2), 2, "150"),
        (12345.0, 3, "12,300"),
        (1.23e-7, 2, "0.00000012"),
        (-0.5, 2, "−0.5"),
        (0.0, 2, "0"),
        (float("nan"), 2, "nan"),
        (float("inf"), 3, "inf"),
    ],
)
def test_number_has_a_few_digits_and_no_exponent(value, digits, text):
    assert rounded(value, digits) == text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("mean -0.00, -1.25 mas", "mean 0.00, −1.25 mas"),
        ("-1,200 (-0.001 to -0)", "−1,200 (−0.001 to 0)"),
        ("1 ± -2e-05", "1 ± −2e-05"),
        ("fields 0-3 at 2028-02-01, --drift -2", "fields 0-3 at 2028-02-01, --drift −2"),
        ("−0.5 and +0.3", "−0.5 and +0.3"),
    ],
)
def test_negative_numbers_have_a_minus_sign_and_zero_has_none(text, expected):
    assert with_minus_signs(text) == expected


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (9.79, 63.4, "10 ± 63"),
        (1236.0, 634.0, "1,240 ± 630"),
        (-0.12345, 0.0678, "−0.123 ± 0.068"),
        (0.2, 0.0996, "0.20 ± 0.10"),
        (-0.001, 0.99, "0.00 ± 0.99"),
    ],
)
def test_number_has_the_decimals_of_its_uncertainty(value, error, text):
    assert with_error(value, error) == text
