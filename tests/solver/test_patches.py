from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.forward import Index
from solver.layout import PER_EXPOSURE, Layout
from solver.normal import accumulate
from solver.patches import MOST, field_sets
from solver.schur import reduce

N_SRC = 60
# Of each exposure; they need not be in order.
FIELD = np.array([0, 0, 1, 2, 1, 2, 2, 0])
EXPOSURES = pd.DataFrame({"field_id": 7 + FIELD})
LAYOUT = Layout(n_exp=len(FIELD), n_coef=3, n_det=2)


@pytest.fixture
def index():
    """Every source is seen by a few exposures, on any detector."""
    rng = np.random.default_rng(0)
    seen = rng.random((N_SRC, len(FIELD))) < 0.2
    seen[np.arange(N_SRC), rng.integers(0, len(FIELD), N_SRC)] = True
    source, exposure = np.nonzero(seen)
    return Index(source, exposure, rng.integers(0, 2, len(source)))


def touched(index, source):
    """Return the columns in which a source has anything, or may have."""
    exposures = np.flatnonzero(np.isin(FIELD, FIELD[index.exposure[index.source == source]]))
    of_exposures = [LAYOUT.columns(group)[exposures] for group in PER_EXPOSURE]
    shared = np.arange(LAYOUT.first_coefficient, LAYOUT.size)
    return {*np.concatenate([*of_exposures, shared]).tolist()}


def check(patches, index):
    """Every source has one place, in a patch with all columns that it touches."""
    np.testing.assert_array_equal(patches.order[patches.position], np.arange(N_SRC))
    places = np.concatenate([np.arange(N_SRC)[patch.places] for patch in patches.parts])
    np.testing.assert_array_equal(places, np.arange(N_SRC))
    for patch in patches.parts:
        for source in patches.order[patch.places]:
            assert touched(index, source) <= {*patch.columns.tolist()}


def patches_of(index):
    return field_sets(index, EXPOSURES, N_SRC).touching(LAYOUT)


def test_patch_is_of_sources_seen_by_the_same_fields(index):
    patches = patches_of(index)
    check(patches, index)
    assert len(patches.parts) > 3
    for patch in patches.parts:
        for source in patches.order[patch.places]:
            assert touched(index, source) == {*patch.columns.tolist()}


def test_patches_that_save_nothing_are_joined(index, monkeypatch):
    alone = len(patches_of(index).parts)
    monkeypatch.setattr("solver.patches.OF_ALL", LAYOUT.size - LAYOUT.first_coefficient)
    monkeypatch.setattr("solver.patches.OF_ONE_BLOCK", 2.0 * LAYOUT.size**2)
    some = patches_of(index)
    check(some, index)
    assert 1 < len(some.parts) < alone
    monkeypatch.setattr("solver.patches.OF_ONE_BLOCK", 1e300)
    (patch,) = patches_of(index).parts
    np.testing.assert_array_equal(patch.columns, np.arange(LAYOUT.size))


def test_rare_sets_of_fields_share_a_patch(index, monkeypatch):
    monkeypatch.setattr("solver.patches.MOST", 3)
    patches = patches_of(index)
    check(patches, index)
    assert len(patches.parts) == 3 < MOST


def test_patches_of_a_chain_stand_last(index):
    patches = patches_of(index)
    chains = patches.chains()
    assert sorted(number for chain in chains for number in chain) == [*range(len(patches.parts))]
    assert len(chains) < len(patches.parts)
    for chain in chains:
        order = patches.last(chain, LAYOUT.size)
        np.testing.assert_array_equal(np.sort(order), np.arange(LAYOUT.size))
        for number in chain:
            columns = patches.parts[number].columns
            assert {*order[-len(columns) :].tolist()} == {*columns.tolist()}


def test_no_measurement_makes_one_patch():
    nothing = np.zeros(0, dtype=np.int64)
    (patch,) = patches_of(Index(*3 * [nothing])).parts
    assert patch.places == slice(0, N_SRC)


def test_nothing_lies_outside_the_blocks(equations):
    outside = equations.cross.copy()
    for patch in equations.patches.parts:
        outside[patch.columns, :, patch.places] = 0.0
    assert len(equations.patches.parts) == 3
    assert not outside.any()


def test_solution_does_not_depend_on_the_patches(reduced, problem, expansion_point):
    together = problem.exposures.assign(field_id=0)
    sets = field_sets(problem.observed.index, together, problem.n_src)
    joined = replace(problem, observed=replace(problem.observed, sets=sets))
    assert len(joined.patches.parts) == 1 < len(reduced.patches.parts)
    other = reduce(accumulate(joined, *expansion_point), joined.priors)
    for name in ("theta_covariance", "marginal_covariance", "log_determinant"):
        found, expected = getattr(reduced, name)(), getattr(other, name)()
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())


def test_marginal_covariance_is_had_where_rounding_leaves_no_cholesky_factor(reduced):
    expected = reduced.marginal_covariance()
    rounded = replace(reduced, matrix=-reduced.matrix)
    np.testing.assert_allclose(rounded.marginal_covariance(), expected, rtol=1e-9)
