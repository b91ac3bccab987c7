import numpy as np
import pytest

from solver.results.simple_structure import joint_axes


def random_axes(rng, n):
    return np.linalg.qr(rng.standard_normal((n, n)))[0]


def off_diagonal(matrices):
    return matrices - matrices * np.eye(matrices.shape[-1])


@pytest.mark.parametrize("n", [1, 2, 7], ids=["one", "two", "seven"])
def test_common_axes_are_found(n):
    rng = np.random.default_rng(n)
    axes = random_axes(rng, n)
    matrices = np.array([axes * rng.uniform(size=n) @ axes.T for _ in range(3)])
    found = joint_axes(matrices)
    np.testing.assert_allclose(off_diagonal(found.T @ matrices @ found), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(found.T @ axes).max(axis=0), 1.0, rtol=1e-9)


def test_axes_degenerate_in_one_matrix_are_separated_by_another():
    rng = np.random.default_rng(0)
    axes = random_axes(rng, 3)
    values = np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    matrices = np.array([axes * row @ axes.T for row in values])
    found = joint_axes(matrices)
    np.testing.assert_allclose(np.abs(found.T @ axes).max(axis=0), 1.0, rtol=1e-9)


def test_axes_are_orthonormal_and_improve_without_common_axes():
    rng = np.random.default_rng(1)
    matrices = rng.standard_normal((4, 5, 5))
    matrices += matrices.swapaxes(1, 2)
    found = joint_axes(matrices)
    np.testing.assert_allclose(found.T @ found, np.eye(5), atol=1e-12)
    after = np.sum(off_diagonal(found.T @ matrices @ found) ** 2)
    assert after < np.sum(off_diagonal(matrices) ** 2)


def test_input_matrices_are_not_changed():
    matrices = np.array([[[2.0, 1.0], [1.0, 0.0]]])
    joint_axes(matrices)
    assert matrices.tolist() == [[[2.0, 1.0], [1.0, 0.0]]]
