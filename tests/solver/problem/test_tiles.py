import numpy as np
import pytest
import scipy.sparse as sp

from solver.model.forward import Index
from solver.problem.tiles import FEW_TILES, SLOTS, lay_tiles


def measurements(lengths, seed=0):
    """Return measurements of so many per exposure and detector, in working order."""
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
def laid(request):
    index, measured, sigma = measurements(LENGTHS[request.param])
    return index, measured, sigma, lay_tiles(index, measured, sigma)


def by_slot(values, tiles):
    """Return values as they lie in memory, one column for each of two axes."""
    return np.moveaxis(values, 1, -1).reshape(-1, 2)[tiles.place]


def test_every_measurement_has_a_slot_of_its_own(laid):
    index, measured, sigma, tiles = laid
    assert len(set(tiles.place)) == len(measured)
    np.testing.assert_array_equal(by_slot(tiles.measured, tiles), measured)
    np.testing.assert_array_equal(by_slot(tiles.weight, tiles), 1.0 / sigma)
    np.testing.assert_array_equal(tiles.index.source.ravel()[tiles.place], index.source)


def test_a_tile_holds_one_exposure_and_one_detector(laid):
    index, _, _, tiles = laid
    for found, expected in zip(tiles.index[1:], index[1:], strict=True):
        whole = np.broadcast_to(found, tiles.index.source.shape)
        np.testing.assert_array_equal(whole.ravel()[tiles.place], expected)


def test_other_slots_have_no_weight(laid):
    _, measured, _, tiles = laid
    assert (tiles.weight != 0.0).sum() == measured.size


def test_chunks_lie_where_jax_takes_them_without_a_copy(laid):
    tiles = laid[-1]
    for i in range(len(tiles.measured)):
        index, *values = tiles.chunk(i)
        assert all(part.ctypes.data % 64 == 0 for part in (*index, *values))


def test_few_tiles_make_one_small_chunk(monkeypatch):
    monkeypatch.setattr("solver.problem.tiles.CHUNK", 256)
    few, many = ({(m, 0): SLOTS for m in range(n)} for n in (FEW_TILES, FEW_TILES + 1))
    assert lay_tiles(*measurements(few)).measured.shape == (1, 2, FEW_TILES, SLOTS)
    assert lay_tiles(*measurements(many)).measured.shape == (1, 2, 256, SLOTS)


def test_values_are_gathered_by_detector_and_source(laid):
    tiles, n_values = laid[-1], 3
    n_slots = tiles.index.source.size
    values = np.random.default_rng(0).standard_normal((n_values, n_slots))
    seen = np.random.default_rng(1).standard_normal((n_slots, 2))
    position = np.random.default_rng(2).permutation(50)
    places = tiles.by_source(position, 4, n_values)
    gather = sp.csr_array(
        (values.ravel()[places.value], places.slot, places.first), shape=(600, n_slots)
    )
    found = (gather @ seen).reshape(4, 50, n_values, 2)
    detector = np.broadcast_to(tiles.index.detector, tiles.index.source.shape).ravel()
    expected = np.zeros_like(found)
    for value in range(n_values):
        pairs = np.stack([detector, position[tiles.index.source].ravel()])[:, tiles.place]
        np.add.at(expected, (*pairs, value), (values[value][:, None] * seen)[tiles.place])
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
