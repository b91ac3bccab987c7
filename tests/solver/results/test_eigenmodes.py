"""Eigenmodes compared with dense matrices, and the priors that determine the weak ones."""

from typing import NamedTuple

import numpy as np
import pytest
import scipy.linalg as sl

from solver.data.parameters import BY_NAME
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import find_mode
from solver.problem.problem import build_problem
from solver.results.eigenmodes import find_eigenmodes


class Blocks(NamedTuple):
    """Reduced matrices of the data, with the priors of reference sources, and with all priors."""

    data: np.ndarray
    references: np.ndarray
    full: np.ndarray


def reduced_matrix(hessian, n):
    cross = hessian[:n, n:]
    return hessian[:n, :n] - cross @ np.linalg.solve(hessian[n:, n:], cross.T)


def is_reference(problem):
    return problem.sources["is_reference"].to_numpy(bool)


def eigenmodes_of(reduced, problem):
    return find_eigenmodes(reduced, problem.priors, problem.layout, is_reference(problem))


@pytest.fixture(scope="module")
def blocks(problem, dense):
    n = dense.n_calib
    data_hessian = dense.jacobian.T @ dense.jacobian
    references = np.zeros(len(data_hessian))
    references[n:] = np.repeat(is_reference(problem), 2)
    with_references = data_hessian + dense.prior * np.outer(references, references)
    return Blocks(*(reduced_matrix(h, n) for h in (data_hessian, with_references, dense.hessian)))


@pytest.fixture
def found(reduced, problem):
    return eigenmodes_of(reduced, problem)


def quadratic(matrix, vectors):
    return np.einsum("ik,ij,jk->k", vectors, matrix, vectors)


def test_shares_of_the_data_equal_the_generalised_eigenvalues(found, blocks):
    expected = np.clip(sl.eigh(blocks.data, blocks.full, eigvals_only=True), 0.0, None)
    # Eigenmodes that the data do not constrain are mixed for simple structure.
    is_unconstrained = expected < 1e-3
    assert 4 < is_unconstrained.sum() < 30
    np.testing.assert_allclose(
        np.sort(found.data)[~is_unconstrained], expected[~is_unconstrained], atol=1e-6
    )
    assert np.sort(found.data)[is_unconstrained].max() < 1e-3
    assert found.data[is_unconstrained].sum() == pytest.approx(
        expected[is_unconstrained].sum(), abs=1e-6
    )


def test_eigenmodes_are_independent_and_one_sigma_long(found, blocks):
    product = found.vectors.T @ blocks.full @ found.vectors
    np.testing.assert_allclose(product, np.eye(len(product)), atol=1e-5)


def test_shares_equal_those_of_the_dense_matrices(found, blocks, dense):
    n, v = dense.n_calib, found.vectors
    calibration = quadratic(dense.prior[:n, :n], v)
    reference_share = quadratic(blocks.references - blocks.data, v)
    source_share = quadratic(blocks.full - blocks.references, v) - calibration
    np.testing.assert_allclose(found.references, reference_share, atol=1e-5)
    np.testing.assert_allclose(found.calibration, calibration, atol=1e-8)
    np.testing.assert_allclose(found.sources, source_share, atol=1e-5)


def test_shares_sum_to_one(found):
    total = found.data + found.references + found.sources + found.calibration
    np.testing.assert_allclose(total, 1.0, atol=1e-12)


def test_no_share_is_negative(found):
    for shares in (found.data, found.references, found.sources, found.calibration):
        assert shares.min() >= 0.0


def test_relative_information_is_the_ratio_to_that_of_single_parameters(found, blocks, dense):
    alone = np.diag(dense.hessian)[: dense.n_calib] @ found.vectors**2
    np.testing.assert_allclose(found.relative, 1.0 / alone, rtol=1e-4)


def test_source_shifts_equal_the_dense_ones(found, reduced, dense):
    n, weak = dense.n_calib, found.vectors[:, :3]
    expected = -np.linalg.solve(dense.hessian[n:, n:], dense.hessian[n:, :n] @ weak)
    shifts = reduced.source_shifts(weak).swapaxes(1, 2).reshape(3, -1).T
    np.testing.assert_allclose(shifts, expected, atol=1e-8 * np.abs(expected).max())


def solved(orbit, **widths):
    problem = build_problem(orbit.data, orbit.instrument, FitSettings(prior_widths=widths))
    mode = find_mode(problem, FitSettings(prior_widths=widths))
    return problem, mode, eigenmodes_of(mode.reduced, problem)


def group_shares(problem, mode, found, group):
    """Return the share of the priors of one group in every eigenmode."""
    columns = problem.layout.columns(BY_NAME[group])
    return problem.priors.hessian_diagonal(mode.theta)[columns] @ found.vectors[columns] ** 2


@pytest.mark.parametrize("group", ["detector_x", "detector_y", "focal_length"])
def test_eigenmode_constrained_by_a_single_prior_is_found(small_orbit, group):
    problem, mode, found = solved(small_orbit)
    shares = group_shares(problem, mode, found, group)
    place = int(np.argmax(shares))
    assert shares[place] > 0.9
    assert found.data[place] < 1e-3


def test_share_of_a_prior_follows_its_width(small_orbit):
    # Only their priors determine a common change of focal lengths and pixel pitches.
    def pitch_share(**widths):
        problem, mode, found = solved(small_orbit, **widths)
        place = int(np.argmax(group_shares(problem, mode, found, "focal_length")))
        return sum(group_shares(problem, mode, found, f"pitch_{axis}")[place] for axis in "xy")

    before = pitch_share()
    after = pitch_share(pitch_x=1e-3, pitch_y=1e-3)
    assert before < 0.05
    assert after == pytest.approx(100.0 * before / (1.0 + 99.0 * before), rel=0.05)


def test_reference_sources_constrain_a_common_shift_of_the_pointings(small_orbit):
    problem, _, found = solved(small_orbit)
    columns = problem.layout.columns(BY_NAME["pointing_ra"])
    moves = found.vectors[columns][:, found.references > 0.99]
    common = np.abs(moves.mean(axis=0)) > 0.95 * np.sqrt((moves**2).mean(axis=0))
    assert common.any()


def test_wider_source_priors_raise_the_shares_of_the_data(small_orbit):
    found = solved(small_orbit, sources=10.0)[2]
    default = solved(small_orbit)[2]
    assert found.data.sum() > default.data.sum()
