from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.linear.covariances import marginal_covariance
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import ReducedSystem, eliminate_sources
from solver.model.forward import Index
from solver.problem.parameter_vector import PER_EXPOSURE, VectorLayout
from solver.problem.source_blocks import MAX_BLOCKS, field_sets

N_SRC = 60
# Field of each exposure, in no particular order.
FIELD = np.array([0, 0, 1, 2, 1, 2, 2, 0])
EXPOSURES = pd.DataFrame({"field_id": 7 + FIELD})
LAYOUT = VectorLayout(n_exp=len(FIELD), n_coef=3, n_det=2)


@pytest.fixture
def index():
    """A few exposures observe each source, on any detector."""
    rng = np.random.default_rng(0)
    seen = rng.random((N_SRC, len(FIELD))) < 0.2
    seen[np.arange(N_SRC), rng.integers(0, len(FIELD), N_SRC)] = True
    source, exposure = np.nonzero(seen)
    return Index(source, exposure, rng.integers(0, 2, len(source)))


def touched(index, source):
    """Return the columns of the fields of a source, and those that all sources share."""
    exposures = np.flatnonzero(np.isin(FIELD, FIELD[index.exposure[index.source == source]]))
    exposure_columns = [LAYOUT.columns(group)[exposures] for group in PER_EXPOSURE]
    shared = np.arange(LAYOUT.first_coefficient, LAYOUT.size)
    return {*np.concatenate([*exposure_columns, shared]).tolist()}


def check_blocks(blocks, index):
    """Check that every source is in one block, which has all columns of the source."""
    np.testing.assert_array_equal(blocks.order[blocks.position], np.arange(N_SRC))
    places = np.concatenate([np.arange(N_SRC)[block.places] for block in blocks.blocks])
    np.testing.assert_array_equal(places, np.arange(N_SRC))
    for block in blocks.blocks:
        for source in blocks.order[block.places]:
            assert touched(index, source) <= {*block.columns.tolist()}


def source_blocks_of(index):
    return field_sets(index, EXPOSURES, N_SRC).touching(LAYOUT)


def test_block_contains_sources_observed_by_the_same_fields(index):
    blocks = source_blocks_of(index)
    check_blocks(blocks, index)
    assert len(blocks.blocks) > 3
    for block in blocks.blocks:
        for source in blocks.order[block.places]:
            assert touched(index, source) == {*block.columns.tolist()}


def test_blocks_that_save_no_time_are_merged(index, monkeypatch):
    alone = len(source_blocks_of(index).blocks)
    monkeypatch.setattr(
        "solver.problem.source_blocks.SHARED_COLUMNS", LAYOUT.size - LAYOUT.first_coefficient
    )
    monkeypatch.setattr("solver.problem.source_blocks.BLOCK_OVERHEAD", 2.0 * LAYOUT.size**2)
    merged = source_blocks_of(index)
    check_blocks(merged, index)
    assert 1 < len(merged.blocks) < alone
    monkeypatch.setattr("solver.problem.source_blocks.BLOCK_OVERHEAD", 1e300)
    (block,) = source_blocks_of(index).blocks
    np.testing.assert_array_equal(block.columns, np.arange(LAYOUT.size))


def test_rare_sets_of_fields_share_a_block(index, monkeypatch):
    monkeypatch.setattr("solver.problem.source_blocks.MAX_BLOCKS", 3)
    blocks = source_blocks_of(index)
    check_blocks(blocks, index)
    assert len(blocks.blocks) == 3 < MAX_BLOCKS


def test_problem_without_measurements_has_one_block():
    nothing = np.zeros(0, dtype=np.int64)
    (block,) = source_blocks_of(Index(*3 * [nothing])).blocks
    assert block.places == slice(0, N_SRC)


def test_cross_terms_vanish_outside_the_blocks(equations):
    outside = equations.cross.copy()
    for block in equations.source_blocks.blocks:
        outside[block.columns, :, block.places] = 0.0
    assert len(equations.source_blocks.blocks) == 3
    assert not outside.any()


def test_solution_does_not_depend_on_the_blocks(reduced, problem, expansion_point):
    together = problem.exposures.assign(field_id=0)
    merged_sets = field_sets(problem.measurements.index, together, problem.n_src)
    merged_problem = replace(problem, measurements=replace(problem.measurements, sets=merged_sets))
    assert len(merged_problem.source_blocks.blocks) == 1 < len(reduced.source_blocks.blocks)
    other = eliminate_sources(accumulate(merged_problem, *expansion_point), merged_problem.priors)
    for of in (ReducedSystem.theta_covariance, ReducedSystem.log_determinant, marginal_covariance):
        found, expected = of(reduced), of(other)
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
