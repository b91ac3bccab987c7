from dataclasses import replace

import numpy as np
import pytest

from solver.linear.chi2 import gradient
from solver.linear.linearised_chunks import linearised_chunks
from solver.linear.normal_equations import accumulate
from solver.problem.problem import of_rows


def close(found, expected, rtol=1e-9):
    """Compare relative to the largest element of an array."""
    np.testing.assert_allclose(found, expected, atol=rtol * np.abs(expected).max(), rtol=rtol)


@pytest.fixture
def blocks(dense, problem):
    """The blocks of the data's Hessian and of minus its gradient, from the dense Jacobian."""
    n, n_src = dense.n_calib, problem.n_src
    hessian = dense.jacobian.T @ dense.jacobian
    gradient = dense.jacobian.T @ dense.residual
    source_hessian = hessian[n:, n:].reshape(n_src, 2, n_src, 2)
    return {
        "theta": hessian[:n, :n],
        "cross": hessian[:n, n:]
        .reshape(n, n_src, 2)
        .swapaxes(1, 2)[:, :, problem.source_blocks.order],
        "source": source_hessian[np.arange(n_src), :, np.arange(n_src), :],
        "by_theta": gradient[:n],
        "by_source": gradient[n:].reshape(n_src, 2),
    }


def block_named(equations, name):
    return getattr(equations if hasattr(equations, name) else equations.gradient, name)


@pytest.mark.parametrize("name", ["theta", "source", "cross", "by_theta", "by_source"])
def test_block_equals_that_of_the_dense_jacobian(equations, blocks, dense, name):
    scale = np.sqrt(np.diag(dense.hessian))[: dense.n_calib]
    found, expected = block_named(equations, name), blocks[name]
    unit = {"theta": np.outer(scale, scale), "cross": scale[:, None, None], "by_theta": scale}
    found, expected = found / unit.get(name, 1.0), expected / unit.get(name, 1.0)
    # Residuals are accurate to 1e-8 of their sigma.
    close(found, expected, rtol=1e-7 if name.startswith("by_") else 1e-9)


def test_blocks_equal_the_sums_over_the_detectors(equations, problem):
    sums, layout = equations.by_detector, problem.layout
    close(sums.theta.sum(axis=0), equations.theta)
    close(sums.source.sum(axis=0).transpose(2, 0, 1), equations.source)
    close(sums.coefficients.sum(axis=0), equations.cross[layout.coefficients()])
    close(sums.by_theta.sum(axis=0), equations.gradient.by_theta)
    assert sums.chi2.sum() == pytest.approx(equations.gradient.chi2)


@pytest.mark.parametrize("detector", range(4))
def test_sums_of_a_detector_equal_those_of_its_measurements(
    detector, equations, problem, expansion_point
):
    sums, layout = equations.by_detector, problem.layout
    alone = accumulate(
        of_rows(problem, problem.measurements.index.detector == detector), *expansion_point
    )
    close(sums.theta[detector], alone.theta)
    close(sums.source[detector].transpose(2, 0, 1), alone.source)
    close(sums.coefficients[detector], alone.cross[layout.coefficients()])
    close(sums.by_theta[detector], alone.gradient.by_theta, rtol=1e-7)
    close(sums.by_source[detector].T, alone.gradient.by_source, rtol=1e-7)
    assert sums.chi2[detector] == pytest.approx(alone.gradient.chi2, rel=1e-8)


def test_sources_are_not_coupled(dense, problem):
    """V is block-diagonal, which the elimination relies on."""
    n = dense.n_calib
    source_hessian = (dense.jacobian.T @ dense.jacobian)[n:, n:].reshape(problem.n_src, 2, -1, 2)
    source_hessian[np.arange(problem.n_src), :, np.arange(problem.n_src), :] = 0.0
    np.testing.assert_array_equal(source_hessian, 0.0)


def test_chi2_equals_the_sum_of_squared_residuals(equations, dense):
    assert equations.gradient.chi2 == pytest.approx(dense.residual @ dense.residual, rel=1e-8)


def test_equations_do_not_depend_on_the_chunk_length(
    problem, equations, expansion_point, monkeypatch
):
    monkeypatch.setattr("solver.problem.tiles.CHUNK", 20)
    rebuilt = replace(problem, measurements=replace(problem.measurements))
    other = accumulate(rebuilt, *expansion_point)
    assert (
        rebuilt.measurements.tiles.measured.shape[2]
        == 20
        != problem.measurements.tiles.measured.shape[2]
    )
    for name in ("chi2", "by_theta", "by_source", "theta", "source", "cross"):
        close(block_named(other, name), block_named(equations, name), rtol=1e-7)


def test_given_blocks_between_terms_are_used_unchanged(problem, equations, expansion_point):
    shape = (problem.layout.n_det, *2 * (2, problem.layout.n_coef))
    shared = problem.layout.coefficients()
    known = equations.by_detector.theta[:, shared, shared].reshape(shape)
    doubled = accumulate(problem, *expansion_point, 2.0 * known)
    close(doubled.theta[shared, shared], 2.0 * equations.theta[shared, shared])
    close(doubled.theta[:, : shared.start], equations.theta[:, : shared.start])
    close(doubled.cross, equations.cross)


def test_chunks_follow_the_tiles(problem, expansion_point):
    found = list(linearised_chunks(problem, *expansion_point))
    assert len(found) == len(problem.measurements.tiles.measured) > 1
    for chunk, weight in zip(found, problem.measurements.tiles.weight, strict=True):
        assert chunk.residual[0].shape == weight[0].shape
        assert (chunk.residual[0][weight[0] == 0.0] == 0.0).all()


def test_gradient_equals_that_of_the_normal_equations(problem, equations, expansion_point):
    alone = gradient(problem, *expansion_point)
    for found, expected in zip(alone, equations.gradient, strict=True):
        close(found, expected, rtol=1e-9)
