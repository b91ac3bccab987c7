import numpy as np
import pytest

from solver.data.parameters import CALIBRATION_GROUPS
from solver.problem.parameter_vector import PER_DETECTOR, PER_EXPOSURE, VectorLayout

LAYOUT = VectorLayout(n_exp=3, n_coef=5, n_det=2)


def test_every_column_belongs_to_one_group():
    columns = np.concatenate([LAYOUT.columns(g) for g in CALIBRATION_GROUPS])
    assert sorted(columns) == list(range(LAYOUT.size))


def test_size_is_four_per_exposure_two_per_term_and_five_per_detector():
    assert LAYOUT.size == 4 * 3 + 2 * 5 + 5 * 2


def test_scatter_is_the_inverse_of_gather():
    flat = np.random.default_rng(0).normal(size=LAYOUT.size)
    np.testing.assert_array_equal(LAYOUT.gather(LAYOUT.scatter(flat)), flat)


def test_group_values_survive_gather_and_scatter():
    values = {g.name: np.arange(len(LAYOUT.columns(g))) + 0.0 for g in CALIBRATION_GROUPS}
    scattered = LAYOUT.scatter(LAYOUT.gather(values))
    for name, expected in values.items():
        np.testing.assert_array_equal(scattered[name], expected)


@pytest.mark.parametrize(("m", "n"), [(0, 0), (2, 1), (1, 0)])
def test_touched_columns_are_those_of_the_exposure_and_the_detector(m, n):
    element = {"exp": m, "det": n}
    expected = [LAYOUT.columns(g)[element[g.axis]] for g in CALIBRATION_GROUPS if g.axis != "coef"]
    found = LAYOUT.touched(np.array([m, 0]), np.array([n, 0]))
    assert sorted(found[0]) == sorted(expected)


def test_order_without_terms_has_no_distortion_columns():
    layout = VectorLayout(2, 0, 1)
    assert layout.first_coefficient == layout.first_detector
    assert layout.size == 2 * len(PER_EXPOSURE) + len(PER_DETECTOR)
