"""The places of ids among known ones: by a table, or by a hash where ids are far apart."""

import numpy as np
import pytest

from solver.data.places import places_among


@pytest.mark.parametrize("step", [1, 10**6, 10**14])
def test_place_of_each_pair_is_found(step):
    random = np.random.default_rng(0)
    field = step * np.repeat([3, 5, -2], 4)
    plate = step * np.tile([0, 7, 9, 1], 3)
    order, expected = random.permutation(12), random.integers(0, 12, 1000)
    known = [field[order], plate[order]]
    found = places_among(known, [column[expected] for column in known])
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("step", [1, 10**14])
def test_place_of_each_id_is_found(step):
    ids, expected = step * np.array([4, 0, 2]), np.array([2, 2, 0, 1])
    np.testing.assert_array_equal(places_among([ids], [ids[expected]]), expected)


def test_no_ids_have_no_places():
    nothing = np.empty(0, dtype=np.int64)
    assert len(places_among([nothing], [nothing])) == 0


@pytest.mark.parametrize("unknown", [-1, 3, 2**40])
def test_id_outside_the_range_of_the_known_ones_is_an_error(unknown):
    with pytest.raises(ValueError, match="invalid entry"):
        places_among([np.arange(3)], [np.array([unknown])])
