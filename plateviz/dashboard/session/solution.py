"""Solution: one solution of a browser session; Request: one that is to be computed."""

from typing import NamedTuple

from plateviz.solving.made_solutions import MadeSolution
from solver.data.result import FitResult
from solver.data.settings import FitSettings

_OF_WHAT_IF = "what if: {}"


class Request(NamedTuple):
    """A solution that is to be computed, unless the store has it already.

    Attributes
    ----------
    orbit : orbit_id, or None for files of one orbit
    settings : of the fit
    is_what_if : whether a step from the last fit is enough
    """

    orbit: int | None
    settings: FitSettings
    is_what_if: bool = False

    @classmethod
    def of(cls, made: MadeSolution) -> "Request":
        """Return the request for a solution that a session has made."""
        return cls(made.orbit, made.settings, made.is_what_if)


class Solution(NamedTuple):
    """One solution of the session, with the orbit and settings requested.

    Attributes
    ----------
    orbit, settings : as of `Request`
    result : of the fit
    is_replaceable : whether the next what-if replaces it
    is_what_if : whether it was computed by a step from a fit, listed or not
    run : name of the run that it was read from; empty for none
    kept : name of the kept solution that it was read from; empty for none
    """

    orbit: int | None
    settings: FitSettings
    result: FitResult
    is_replaceable: bool = False
    is_what_if: bool = False
    run: str = ""
    kept: str = ""

    @classmethod
    def of(cls, request: Request, result: FitResult) -> "Solution":
        """Return the solution that answers a request; the next what-if replaces a what-if."""
        orbit, settings, is_what_if = request
        return cls(orbit, settings, result, is_replaceable=is_what_if, is_what_if=is_what_if)

    @property
    def label(self) -> str:
        """Short description of the solution."""
        text = self.settings.describe()
        if self.kept:
            return f"{self.kept}: {text}"
        return _OF_WHAT_IF.format(text) if self.is_replaceable else text

    def answers(self, request: "Request | Solution") -> bool:
        """Whether it is of the orbit and the settings of a request, or of another solution."""
        return (self.orbit, self.settings) == (request.orbit, request.settings)

    def equals(self, other: "Solution") -> bool:
        """Whether both are the same solution of the same orbit."""
        mine, theirs = ((one.is_what_if, one.run, one.kept) for one in (self, other))
        return self.answers(other) and mine == theirs


def what_if_settings(settings: FitSettings, fitted: FitSettings) -> FitSettings:
    """Return the settings of a what-if; it keeps a comparison of orders only if still valid."""
    is_still_valid = settings.with_(order=fitted.order, compare_orders=True) == fitted
    return settings.with_(compare_orders=is_still_valid)
