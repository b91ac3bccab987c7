import numpy as np
import pytest

from plateviz.tables.chance import largest_by_chance


def test_limit_of_one_value_is_that_of_the_normal_distribution():
    assert largest_by_chance(1, 0.0455) == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize("count", [5, 200])
def test_largest_of_noise_exceeds_the_limit_as_often_as_stated(count):
    maps = np.random.default_rng(1).standard_normal((20_000, count))
    beyond = (np.abs(maps).max(axis=1) > largest_by_chance(count)).sum()
    # Binomial with a mean of 200 and a standard deviation of 14.
    assert beyond == pytest.approx(200, abs=56)


@pytest.mark.parametrize(("count", "probability"), [(0, 0.01), (3, 0.0), (3, 1.0)])
def test_impossible_questions_are_refused(count, probability):
    with pytest.raises(ValueError, match="at least one value and a probability between 0 and 1"):
        largest_by_chance(count, probability)
