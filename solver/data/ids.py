"""Ids of sources, exposures and detectors as text: whole numbers of 64 bits."""

ID = r"-?[0-9]{1,19}"
"""Pattern of an id; not all that match are in range."""
_LARGEST = 2**63 - 1


def is_id(number: int) -> bool:
    """Return whether a number is an id, which tables can hold."""
    return abs(number) <= _LARGEST
