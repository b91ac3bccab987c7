"""What a machine has room for."""

import pytest

from plateviz.solving import capacity
from plateviz.solving.capacity import ready_orbits, usual_solvers


@pytest.mark.parametrize(
    ("gib", "solvers", "orbits"), [(2, 1, 3), (8, 2, 3), (24, 3, 8), (1024, 3, 16)]
)
def test_more_memory_has_room_for_more(gib, solvers, orbits, monkeypatch):
    monkeypatch.setattr(capacity, "available_bytes", lambda: gib * 2**30)
    monkeypatch.setattr(capacity, "count_cores", lambda: 8)
    assert (usual_solvers(), ready_orbits()) == (solvers, orbits)


def test_one_core_has_one_solver_for_what_ifs_and_one_for_long_fits(monkeypatch):
    monkeypatch.setattr(capacity, "available_bytes", lambda: 24 * 2**30)
    monkeypatch.setattr(capacity, "count_cores", lambda: 1)
    assert usual_solvers() == 2
