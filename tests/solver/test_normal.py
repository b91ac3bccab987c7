from dataclasses import replace

import numpy as np
import pytest

from solver.normal import accumulate, chunks
from solver.objective import gradient


def close(found, expected, rtol=1e-9):
    """Compare on the scale of the diagonal, since the units of the parameters differ."""
    np.testing.assert_allclose(found, expected, atol=rtol * np.abs(expected).max(), rtol=rtol)


@pytest.fixture
def blocks(dense, problem):
    """The data's Hessian and minus its gradient in blocks, from the dense Jacobian."""
    n, n_src = dense.n_calib, problem.n_src
    hessian = dense.jacobian.T @ dense.jacobian
    gradient = dense.jacobian.T @ dense.residual
    of_sources = hessian[n:, n:].reshape(n_src, 2, n_src, 2)
    return {
        "theta": hessian[:n, :n],
        "cross": hessian[:n, n:].reshape(n, n_src, 2).swapaxes(1, 2),
        "source": of_sources[np.arange(n_src), :, np.arange(n_src), :],
        "by_theta": gradient[:n],
        "by_source": gradient[n:].reshape(n_src, 2),
    }


def part_of(equations, name):
    return getattr(equations if hasattr(equations, name) else equations.gradient, name)


@pytest.mark.parametrize("name", ["theta", "source", "cross", "by_theta", "by_source"])
def test_block_is_that_of_the_dense_jacobian(equations, blocks, dense, name):
    scale = np.sqrt(np.diag(dense.hessian))[: dense.n_calib]
    found, expected = part_of(equations, name), blocks[name]
    unit = {"theta": np.outer(scale, scale), "cross": scale[:, None, None], "by_theta": scale}
    found, expected = found / unit.get(name, 1.0), expected / unit.get(name, 1.0)
    # A residual is rounded to 1e-8 of its sigma.
    close(found, expected, rtol=1e-7 if name.startswith("by_") else 1e-9)


def test_sources_are_not_coupled(dense, problem):
    """What the elimination rests on: V is block-diagonal."""
    n = dense.n_calib
    of_sources = (dense.jacobian.T @ dense.jacobian)[n:, n:].reshape(problem.n_src, 2, -1, 2)
    of_sources[np.arange(problem.n_src), :, np.arange(problem.n_src), :] = 0.0
    np.testing.assert_array_equal(of_sources, 0.0)


def test_chi2_is_that_of_the_residuals(equations, dense):
    assert equations.gradient.chi2 == pytest.approx(dense.residual @ dense.residual, rel=1e-8)


def test_length_of_chunks_changes_nothing(problem, equations, expansion_point, monkeypatch):
    monkeypatch.setattr("solver.tiles.CHUNK", 20)
    other = accumulate(replace(problem), *expansion_point)
    for name in ("chi2", "by_theta", "by_source", "theta", "source", "cross"):
        close(part_of(other, name), part_of(equations, name), rtol=1e-7)


def test_chunks_are_those_of_the_tiles(problem, expansion_point):
    found = list(chunks(problem, *expansion_point))
    assert len(found) == len(problem.tiles.measured) > 1
    for chunk, weight in zip(found, problem.tiles.weight, strict=True):
        assert chunk.residual[0].shape == weight[0].shape
        assert (chunk.residual[0][weight[0] == 0.0] == 0.0).all()


def test_gradient_alone_is_that_of_the_normal_equations(problem, equations, expansion_point):
    alone = gradient(problem, *expansion_point)
    for found, expected in zip(alone, equations.gradient, strict=True):
        close(found, expected, rtol=1e-9)
