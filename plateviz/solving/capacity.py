"""What the machine has room for: solver processes, and orbits that each keeps ready for what-ifs.

The web process sends a what-if where its orbit is ready, so it must know how many are.
"""

from solver.runtime.available_memory import available_bytes
from solver.runtime.threads import count_cores

_MOST_QUICK, _BYTES_PER_SOLVER = 2, 3 * 2**30
# An orbit of 7,000 sources takes 0.15 GB, with all lower orders from which what-ifs start 0.5.
_BYTES_PER_ORBIT = 0.5 * 2**30
_LEAST_ORBITS, _MOST_ORBITS = 3, 16
# Share of the memory for the orbits of one process.
_SHARE = 1 / 6


def usual_solvers() -> int:
    """Return the number of solver processes that suits this machine.

    These are two for what-ifs, and one for long fits, where it has the cores and the memory.
    """
    return max(1, min(min(_MOST_QUICK, count_cores()) + 1, available_bytes() // _BYTES_PER_SOLVER))


def ready_orbits() -> int:
    """Return the number of orbits that a solver process keeps ready for what-ifs."""
    room = int(_SHARE * available_bytes() / _BYTES_PER_ORBIT)
    return max(_LEAST_ORBITS, min(_MOST_ORBITS, room))
