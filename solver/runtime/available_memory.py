"""How much memory the programs of this machine, or of this container, may use."""

from pathlib import Path

import psutil

# Of control groups, version 2 and 1; each holds a number of bytes, or "max".
_LIMITS = (
    Path("/sys/fs/cgroup/memory.max"),
    Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"),
)


def available_bytes() -> int:
    """Return the memory of the machine, or the limit of the container if it is smaller, bytes."""
    return min([psutil.virtual_memory().total, *filter(None, map(_limit, _LIMITS))])


def _limit(path: Path) -> int | None:
    try:
        return int(path.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None
