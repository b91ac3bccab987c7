"""A cause to be put into words, and what is said of it."""

from typing import NamedTuple

from solver.data.result import FitResult
from solver.results.diagnosis.causes import FoundCauses
from solver.results.diagnosis.found import Found
from solver.results.diagnosis.table import Diagnosis


class Case(NamedTuple):
    """A cause that was found, and the solution that it was found in."""

    found: Found
    causes: FoundCauses
    diagnosis: Diagnosis
    result: FitResult


class Said(NamedTuple):
    """What is said of a cause; see `Cause`."""

    name: str
    title: str
    words: str
    action: str
    options: tuple[str, ...] = ()
