"""Which orbit is read ahead."""

import pytest

from plateviz.dashboard.navigation.next_orbit import NextOrbit

ORBITS = [0, 1, 4, 5]


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        ([0], [1]),
        ([0, 1, 4], [1, 4, 5]),
        ([4, 1, 0], [5, 0, None]),
        ([5], [None]),
        # It is said once.
        ([1, 1], [4, None]),
        # Files of one orbit, and an orbit that is gone.
        ([None, 3], [None, None]),
    ],
)
def test_next_orbit_is_in_the_direction_of_the_last_step(shown, expected):
    following = NextOrbit()
    assert [following.after(orbit, ORBITS) for orbit in shown] == expected
