import numpy as np
import pytest
import scipy.sparse as sp

from solver.model.forward import Index
from solver.problem.tiles import FEW_TILES, SLOTS, lay_tiles


def measurements(lengths, seed=0):
    """Return measurements in working order, with given numbers per exposure and detector."""
    rng = np.random.default_rng(seed)
    exposure = np.repeat([m for m, _ in lengths], list(lengths.values()))
    detector = np.repeat([n for _, n in lengths], list(lengths.values()))
    n_obs = len(exposure)
    index = Index(rng.integers(0, 50, n_obs), exposure, detector)
    return index, rng.normal(size=(n_obs, 2)), rng.uniform(0.5, 2.0, (n_obs, 2))


LENGTHS = {
    "one": {(0, 0): 1},
    "exactly-full": {(0, 0): SLOTS, (0, 1): SLOTS},
    "one-more": {(0, 0): SLOTS + 1, (1, 0): 3},
    "uneven": {(0, 1): 5, (0, 3): 3 * SLOTS + 7, (2, 0): 40, (2, 1): 2 * SLOTS},
}


@pytest.fixture(params=LENGTHS)
def case(request):
    index, measured, sigma = measurements(LENGTHS[request.param])
    return index, measured, sigma, lay_tiles(index, measured, sigma)


def by_slot(values, tiles):
    """Return the values of each measurement, one column for each of two axes."""
    return np.moveaxis(values, 1, -1).reshape(-1, 2)[tiles.place]


def test_every_measurement_has_its_own_slot(case):
    index, measured, sigma, tiles = case
    assert len(set(tiles.place)) == len(measured)
    np.testing.assert_array_equal(by_slot(tiles.measured, tiles), measured)
    np.testing.assert_array_equal(by_slot(tiles.weight, tiles), 1.0 / sigma)
    np.testing.assert_array_equal(tiles.index.source.ravel()[tiles.place], index.source)


def test_tile_has_one_exposure_and_one_detector(case):
    index, _, _, tiles = case
    for found, expected in zip(tiles.index[1:], index[1:], strict=True):
        whole = np.broadcast_to(found, tiles.index.source.shape)
        np.testing.assert_array_equal(whole.ravel()[tiles.place], expected)


def test_empty_slots_have_zero_weight(case):
    _, measured, _, tiles = case
    assert (tiles.weight != 0.0).sum() == measured.size


def test_chunks_are_aligned_for_jax_to_use_without_a_copy(case):
    tiles = case[-1]
    for i in range(len(tiles.measured)):
        index, *values = tiles.chunk(i)
        assert all(array.ctypes.data % 64 == 0 for array in (*index, *values))


def test_few_tiles_form_one_small_chunk(monkeypatch):
    monkeypatch.setattr("solver.problem.tiles.CHUNK", 256)
    few, many = ({(m, 0): SLOTS for m in range(n)} for n in (FEW_TILES, FEW_TILES + 1))
    assert lay_tiles(*measurements(few)).measured.shape == (1, 2, FEW_TILES, SLOTS)
    assert lay_tiles(*measurements(many)).measured.shape == (1, 2, 256, SLOTS)


def test_values_are_summed_by_detector_and_source(case):
    tiles, n_values = case[-1], 3
    n_slots = tiles.index.source.size
    values = np.random.default_rng(0).standard_normal((n_values, n_slots))
    dense = np.random.default_rng(1).standard_normal((n_slots, 2))
    position = np.random.default_rng(2).permutation(50)
    gathering = tiles.by_source(position, 4, n_values)
    gather = sp.csr_array(
        (values.ravel()[gathering.value], gathering.slot, gathering.first), shape=(600, n_slots)
    )
    found = (gather @ dense).reshape(4, 50, n_values, 2)
    detector = np.broadcast_to(tiles.index.detector, tiles.index.source.shape).ravel()
    expected = np.zeros_like(found)
    for value in range(n_values):
        pairs = np.stack([detector, position[tiles.index.source].ravel()])[:, tiles.place]
        np.add.at(expected, (*pairs, value), (values[value][:, None] * dense)[tiles.place])
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
