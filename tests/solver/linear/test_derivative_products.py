import numpy as np
import pytest

from solver.linear.derivative_products import in_tiles, one_by_one, side_by_side, tiled_derivatives
from solver.linear.linearised_chunks import linearised_chunks
from solver.problem.parameter_vector import PER_DETECTOR, PER_EXPOSURE


@pytest.fixture
def chunk(problem, expansion_point):
    return next(linearised_chunks(problem, *expansion_point))


def test_rows_equal_the_fields_of_a_chunk(chunk):
    rows = tiled_derivatives(chunk)
    assert rows.local.shape[1] == len(PER_EXPOSURE + PER_DETECTOR) + 1
    for found, pairs in (
        (rows.local, [*chunk.local, chunk.residual]),
        (rows.source, chunk.source),
        (rows.displacement, chunk.displacement),
    ):
        for row, pair in enumerate(pairs):
            for axis, values in enumerate(pair):
                np.testing.assert_array_equal(found[:, row, axis], values)


def test_products_are_sums_over_the_two_coordinates():
    rng = np.random.default_rng(0)
    first = [tuple(rng.standard_normal((2, 5, 7))) for _ in range(3)]
    second = [tuple(rng.standard_normal((2, 5, 7))) for _ in range(2)]
    rows = side_by_side(first), side_by_side(second)
    found, of_tiles = one_by_one(*rows), in_tiles(*rows)
    assert found.shape == (3, 2, 5, 7)
    assert of_tiles.shape == (5, 6, 7)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            expected = a[0] * b[0] + a[1] * b[1]
            np.testing.assert_allclose(found[i, j], expected, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(of_tiles[:, 2 * i + j], expected, rtol=1e-12, atol=1e-12)
