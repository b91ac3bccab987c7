import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import legval2d

from solver.data.distortion_terms import terms
from solver.data.settings import MAX_ORDER
from solver.model.distortion import basis
from tests.solver.small_orbit import at_centre

ORDERS = range(MAX_ORDER + 1)
positions = st.lists(
    st.tuples(st.floats(-1.1, 1.1), st.floats(-1.1, 1.1)), min_size=1, max_size=4
).map(np.array)


def numpy_basis(points, order):
    columns = []
    for k, j in terms(order):
        matrix = np.zeros((order + 1, order + 1))
        matrix[k, j] = 1.0
        matrix[0, 0] = -at_centre(k, j)
        columns.append(legval2d(points[:, 0], points[:, 1], matrix))
    return np.stack(columns, axis=-1)


def stacked(x, y, order):
    """Return the basis with one column per term."""
    values = basis(jnp.asarray(x), jnp.asarray(y), order)
    return np.stack(values, axis=-1) if values else np.empty((len(x), 0))


@pytest.mark.parametrize("order", range(2, MAX_ORDER + 1))
@settings(deadline=None, max_examples=8)
@given(points=positions)
def test_basis_agrees_with_numpy(order, points):
    ours = stacked(points[:, 0], points[:, 1], order)
    np.testing.assert_allclose(ours, numpy_basis(points, order), atol=1e-13)


@pytest.mark.parametrize("order", ORDERS)
def test_centre_is_not_displaced(order):
    values = stacked([0.0], [0.0], order)
    np.testing.assert_allclose(values, np.zeros((1, len(terms(order)))), atol=1e-15)


@pytest.mark.parametrize("order", ORDERS)
def test_terms_have_degrees_from_two_up_to_the_order(order):
    expected = {(k, j) for k in range(10) for j in range(10) if 2 <= k + j <= order}
    assert set(terms(order)) == expected
    assert len(terms(order)) == len(expected)


@pytest.mark.parametrize("order", range(MAX_ORDER))
def test_lower_order_is_a_prefix_of_the_next(order):
    assert terms(order + 1)[: len(terms(order))] == terms(order)
    x, y = [0.3, -0.8], [0.9, 0.2]
    lower, higher = stacked(x, y, order), stacked(x, y, order + 1)
    np.testing.assert_array_equal(lower, higher[:, : lower.shape[1]])


def test_fifth_order_has_18_coefficients_in_the_published_order():
    assert len(terms(5)) == 18
    assert terms(5)[:7] == [(2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)]
    assert terms(5)[-1] == (0, 5)


def test_constant_term_agrees_with_the_paper():
    """Eq. (model:A0), evaluated at the centre for random coefficients."""
    values = np.random.default_rng(0).normal(size=18)
    named = dict(zip(terms(5), values, strict=True))
    constant = 0.5 * (named[2, 0] + named[0, 2]) - named[2, 2] / 4.0
    constant -= 3.0 * (named[4, 0] + named[0, 4]) / 8.0
    x, y = 0.37, -0.61
    matrix = np.zeros((6, 6))
    for (k, j), value in named.items():
        matrix[k, j] = value
    matrix[0, 0] = constant
    ours = (stacked([x], [y], 5) @ values)[0]
    np.testing.assert_allclose(ours, legval2d(x, y, matrix), atol=1e-14)
