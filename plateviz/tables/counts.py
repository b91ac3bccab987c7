"""Numbers of orbits, and durations, as text."""

from solver.data.plural import plural


def orbits_text(number: int) -> str:
    """Return a number of orbits: "1 orbit", "83 orbits"."""
    return f"{number:,} {plural(number, 'orbit')}"


def orbits_are(number: int) -> str:
    """Return a number of orbits with the verb: "1 orbit is", "83 orbits are"."""
    return f"{orbits_text(number)} {'is' if number == 1 else 'are'}"


def duration_text(seconds: float) -> str:
    """Return a rough duration: "1 s" at least, "12 min", "2.5 h"."""
    if seconds < 100.0:
        return f"{max(seconds, 1.0):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
