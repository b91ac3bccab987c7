import numpy as np
import pytest

from solver.data.parameter_group import TERM_AXES
from solver.data.settings import FitSettings
from solver.problem.optional_terms import optional_terms
from solver.problem.term_factors import orbital_phase


def test_a_setting_adds_its_terms_in_the_order_of_the_columns():
    settings = FitSettings(drift=3, breathing=2, field_distortion=2, detector_distortion=4)
    found = optional_terms(settings)
    assert tuple(one.axis for one in found) == TERM_AXES[1:]
    assert [one.order for one in found] == [3, 2, 2, 4]
    assert found[-1].name == "own_distortion"


def test_a_fit_without_optional_groups_has_no_optional_terms():
    assert optional_terms(FitSettings()) == []


def test_orbital_phase_is_zero_halfway_and_turns_once_per_period():
    time = np.array([50_000.0, 50_000.5, 50_001.0])
    found = orbital_phase(time, period=720.0)
    np.testing.assert_allclose(found, [-2.0 * np.pi, 0.0, 2.0 * np.pi])
    assert orbital_phase(time, 360.0)[-1] == pytest.approx(4.0 * np.pi)
