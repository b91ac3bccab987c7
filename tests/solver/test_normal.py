import numpy as np
import pytest

from solver.normal import accumulate, chunks, segments


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
        "cross": hessian[n:, :n].reshape(n_src, 2, n),
        "source": of_sources[np.arange(n_src), :, np.arange(n_src), :],
        "by_theta": gradient[:n],
        "by_source": gradient[n:].reshape(n_src, 2),
    }


@pytest.mark.parametrize("name", ["theta", "source", "cross", "by_theta", "by_source"])
def test_block_is_that_of_the_dense_jacobian(equations, blocks, dense, name):
    scale = np.sqrt(np.diag(dense.hessian))[: dense.n_calib]
    found, expected = getattr(equations, name), blocks[name]
    if name == "theta":
        found, expected = found / np.outer(scale, scale), expected / np.outer(scale, scale)
    elif name in ("cross", "by_theta"):
        found, expected = found / scale, expected / scale
    # A residual is rounded to 1e-8 of its sigma.
    close(found, expected, rtol=1e-7 if name.startswith("by_") else 1e-9)


def test_sources_are_not_coupled(dense, problem):
    """What the elimination rests on: V is block-diagonal."""
    n = dense.n_calib
    of_sources = (dense.jacobian.T @ dense.jacobian)[n:, n:].reshape(problem.n_src, 2, -1, 2)
    of_sources[np.arange(problem.n_src), :, np.arange(problem.n_src), :] = 0.0
    np.testing.assert_array_equal(of_sources, 0.0)


def test_chi2_is_that_of_the_residuals(equations, dense):
    assert equations.chi2 == pytest.approx(dense.residual @ dense.residual, rel=1e-8)


def test_length_of_chunks_changes_nothing(problem, equations, expansion_point, monkeypatch):
    monkeypatch.setattr("solver.normal.CHUNK", 500)
    other = accumulate(problem, *expansion_point)
    for name in ("chi2", "by_theta", "by_source", "theta", "source", "cross"):
        close(getattr(other, name), getattr(equations, name), rtol=1e-7)


def test_chunks_cover_every_measurement_once(problem, expansion_point):
    covered = []
    for rows, chunk in chunks(problem, *expansion_point):
        assert len(chunk.residual) == rows.stop - rows.start
        covered += range(rows.start, rows.stop)
    assert covered == list(range(problem.n_obs))


def test_segments_hold_one_exposure_and_one_detector_each(problem, expansion_point):
    for rows, chunk in chunks(problem, *expansion_point):
        covered = []
        for segment in segments(problem, rows, chunk):
            here = slice(rows.start + segment.rows.start, rows.start + segment.rows.stop)
            assert set(problem.index.exposure[here]) == {segment.exposure}
            assert set(problem.index.detector[here]) == {segment.detector}
            assert len(set(segment.source)) == len(segment.source)
            covered += range(here.start, here.stop)
        assert covered == list(range(rows.start, rows.stop))
