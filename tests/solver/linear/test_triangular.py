import numpy as np
import pytest

from solver.linear.triangular import upper_times, upper_transposed_times


@pytest.mark.parametrize("size", [1, 3, 9])
def test_products_with_a_triangle_equal_those_with_the_whole_matrix(size):
    rng = np.random.default_rng(size)
    upper, right = np.triu(rng.standard_normal((size, size))), rng.standard_normal((size, 4))
    np.testing.assert_allclose(upper_times(upper, right), upper @ right, atol=1e-13)
    np.testing.assert_allclose(upper_transposed_times(upper, right), upper.T @ right, atol=1e-13)
