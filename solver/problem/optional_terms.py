"""OptionalTerms: the distortion terms that settings add, by the table of parameter groups."""

from typing import NamedTuple

from solver.data.parameter_group import TERM_AXES, Axis
from solver.data.settings import FitSettings


class OptionalTerms(NamedTuple):
    """Distortion terms of both directions that a setting adds.

    Attributes
    ----------
    name : of the groups, without "_x" and "_y"
    axis : of their elements
    order : highest degree of the terms
    """

    name: str
    axis: Axis
    order: int


def optional_terms(settings: FitSettings) -> list[OptionalTerms]:
    """Return the terms that a fit includes, in the order of `parameter_group.TERM_AXES`."""
    return [
        OptionalTerms(group.name.removesuffix("_x"), axis, getattr(settings, group.setting))
        for axis in TERM_AXES
        for group in settings.optional_groups
        if group.axis == axis and group.name.endswith("_x")
    ]
