"""NextOrbit: which orbit a person who steps from orbit to orbit is likely to ask for next."""

from collections.abc import Sequence


class NextOrbit:
    """Follows the orbits of one browser session; at first it expects steps forwards."""

    def __init__(self) -> None:
        """Begin without an orbit."""
        self._last: int | None = None
        self._is_back = False

    def after(self, orbit: int | None, orbits: Sequence[int | None]) -> int | None:
        """Return the orbit that is likely to follow one on the screen.

        Parameters
        ----------
        orbit : on the screen; None for files of one orbit
        orbits : that can be asked for, in order

        Returns
        -------
        The next one in the direction of the last step; None at the end, and if `orbit` is the same
        as the last time.
        """
        if orbit is None or orbit == self._last or orbit not in orbits:
            return None
        if self._last is not None:
            self._is_back = orbit < self._last
        self._last = orbit
        place = orbits.index(orbit) + (-1 if self._is_back else 1)
        return orbits[place] if 0 <= place < len(orbits) else None
