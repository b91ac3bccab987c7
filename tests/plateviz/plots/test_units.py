"""Texts of numbers: units that suit their size, powers of ten."""

import pytest

from plateviz.plots.elements.units import finer_unit, power_text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 2, "0"),
        (0.026, 2, "0.026"),
        (495_675.4, 6, "495,675"),
        (7.23e-12, 2, "7.2 × 10⁻¹²"),
        (-3e-7, 1, "−3 × 10⁻⁷"),
        (2.499229e10, 6, "2.49923 × 10¹⁰"),
        (9.99e-4, 1, "1 × 10⁻³"),
        (float("nan"), 2, "nan"),
    ],
)
def test_very_small_and_large_numbers_have_a_power_of_ten(value, digits, text):
    assert power_text(value, digits) == text


@pytest.mark.parametrize(
    ("size", "unit", "found"),
    [
        (5.0, "µm", ("µm", 1.0)),
        (0.02, "µm", ("nm", 1e3)),
        (1e-3, "µm", ("nm", 1e3)),
        (1e-12, "µm", ("pm", 1e6)),
        (0.2, "arcsec", ("mas", 1e3)),
        (1e-9, "ppm", ("ppm", 1.0)),
    ],
)
def test_unit_suits_the_size(size, unit, found):
    assert finer_unit(size, unit) == found
