"""The spectrum against dense matrices, and the priors that decide the weak modes."""

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
    """Reduced matrices of the calibration: of the data, with the references' priors, of all."""

    data: np.ndarray
    references: np.ndarray
    whole: np.ndarray


def reduced_matrix(hessian, n):
    across = hessian[:n, n:]
    return hessian[:n, :n] - across @ np.linalg.solve(hessian[n:, n:], across.T)


def is_reference(problem):
    return problem.sources["is_reference"].to_numpy(bool)


def spectrum_of(reduced, problem):
    return find_eigenmodes(reduced, problem.priors, problem.layout, is_reference(problem))


@pytest.fixture(scope="module")
def blocks(problem, dense):
    n = dense.n_calib
    of_data = dense.jacobian.T @ dense.jacobian
    references = np.zeros(len(of_data))
    references[n:] = np.repeat(is_reference(problem), 2)
    with_references = of_data + dense.prior * np.outer(references, references)
    return Blocks(*(reduced_matrix(h, n) for h in (of_data, with_references, dense.hessian)))


@pytest.fixture
def found(reduced, problem):
    return spectrum_of(reduced, problem)


def quadratic(matrix, vectors):
    return np.einsum("ik,ij,jk->k", vectors, matrix, vectors)


def test_shares_of_the_data_are_the_generalised_eigenvalues(found, blocks):
    expected = np.clip(sl.eigh(blocks.data, blocks.whole, eigvals_only=True), 0.0, None)
    # Those that the data leave open are mixed for simple structure.
    is_open = expected < 1e-3
    assert 4 < is_open.sum() < 30
    np.testing.assert_allclose(np.sort(found.data)[~is_open], expected[~is_open], atol=1e-6)
    assert np.sort(found.data)[is_open].max() < 1e-3
    assert found.data[is_open].sum() == pytest.approx(expected[is_open].sum(), abs=1e-6)


def test_modes_are_one_sigma_long_and_independent(found, blocks):
    product = found.vectors.T @ blocks.whole @ found.vectors
    np.testing.assert_allclose(product, np.eye(len(product)), atol=1e-5)


def test_shares_are_those_of_the_dense_matrices(found, blocks, dense):
    n, v = dense.n_calib, found.vectors
    of_calibration = quadratic(dense.prior[:n, :n], v)
    of_references = quadratic(blocks.references - blocks.data, v)
    of_sources = quadratic(blocks.whole - blocks.references, v) - of_calibration
    np.testing.assert_allclose(found.references, of_references, atol=1e-5)
    np.testing.assert_allclose(found.calibration, of_calibration, atol=1e-8)
    np.testing.assert_allclose(found.sources, of_sources, atol=1e-5)


def test_shares_add_up_to_one(found):
    total = found.data + found.references + found.sources + found.calibration
    np.testing.assert_allclose(total, 1.0, atol=1e-12)


def test_no_share_is_negative(found):
    for shares in (found.data, found.references, found.sources, found.calibration):
        assert shares.min() >= 0.0


def test_relative_information_is_the_quotient_of_the_information(found, blocks, dense):
    alone = np.diag(dense.hessian)[: dense.n_calib] @ found.vectors**2
    np.testing.assert_allclose(found.relative, 1.0 / alone, rtol=1e-4)


def test_source_shifts_are_the_dense_ones(found, reduced, dense):
    n, weak = dense.n_calib, found.vectors[:, :3]
    expected = -np.linalg.solve(dense.hessian[n:, n:], dense.hessian[n:, :n] @ weak)
    shifts = reduced.source_shifts(weak).swapaxes(1, 2).reshape(3, -1).T
    np.testing.assert_allclose(shifts, expected, atol=1e-8 * np.abs(expected).max())


def solved(orbit, **widths):
    problem = build_problem(orbit.data, orbit.instrument, FitSettings(prior_widths=widths))
    mode = find_mode(problem, FitSettings(prior_widths=widths))
    return problem, mode, spectrum_of(mode.reduced, problem)


def group_shares(problem, mode, found, group):
    """Return the share of every mode that the priors of one group decide."""
    here = problem.layout.columns(BY_NAME[group])
    return problem.priors.hessian_diagonal(mode.theta)[here] @ found.vectors[here] ** 2


@pytest.mark.parametrize("group", ["detector_x", "detector_y", "focal_length"])
def test_a_mode_that_one_prior_alone_holds_is_found(small_orbit, group):
    problem, mode, found = solved(small_orbit)
    shares = group_shares(problem, mode, found, group)
    held = int(np.argmax(shares))
    assert shares[held] > 0.9
    assert found.data[held] < 1e-3


def test_the_share_of_a_prior_follows_its_width(small_orbit):
    # Focal lengths and pixel pitches: what is common to them only their two priors decide.
    def pitch_share(**widths):
        problem, mode, found = solved(small_orbit, **widths)
        held = int(np.argmax(group_shares(problem, mode, found, "focal_length")))
        return sum(group_shares(problem, mode, found, f"pitch_{axis}")[held] for axis in "xy")

    before = pitch_share()
    after = pitch_share(pitch_x=1e-3, pitch_y=1e-3)
    assert before < 0.05
    assert after == pytest.approx(100.0 * before / (1.0 + 99.0 * before), rel=0.05)


def test_common_sky_is_left_to_the_reference_sources(small_orbit):
    problem, _, found = solved(small_orbit)
    here = problem.layout.columns(BY_NAME["pointing_ra"])
    moves = found.vectors[here][:, found.references > 0.99]
    common = np.abs(moves.mean(axis=0)) > 0.95 * np.sqrt((moves**2).mean(axis=0))
    assert common.any()


def test_without_source_priors_worth_the_name_the_sky_is_left_to_nobody(small_orbit):
    found = solved(small_orbit, sources=10.0)[2]
    default = solved(small_orbit)[2]
    assert found.data.sum() > default.data.sum()
