"""Solution: one solution of a browser session."""

from typing import NamedTuple

from solver.data.result import FitResult
from solver.data.settings import FitSettings


class Solution(NamedTuple):
    """One solution of the session, with the orbit and settings requested.

    A what-if is requested by a change of a control, and replaced by the next one unless kept.
    """

    orbit: int | None
    settings: FitSettings
    result: FitResult
    is_what_if: bool = False

    @property
    def label(self) -> str:
        """Short description of the solution."""
        return (
            f"what if: {self.settings.describe()}" if self.is_what_if else self.settings.describe()
        )
