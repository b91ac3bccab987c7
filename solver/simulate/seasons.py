"""Observation periods (seasons), paper Table (exp:epoch)."""

import datetime as dt
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

from solver.errors import InputError

_MJD_ZERO = dt.date(1858, 11, 17)


@dataclass(frozen=True)
class Season:
    """One observation period: first and last day, ISO dates in TCB, and the position angle.

    The angle is in Galactic coordinates, deg: zero when y points along Galactic latitude.
    """

    start: str
    end: str
    position_angle_deg: float

    def __post_init__(self) -> None:
        """Check the values; raise `InputError` if one is invalid."""
        if not self.start_mjd < self.end_mjd:
            raise InputError(f"expected a season to end after {self.start}, found {self.end}")
        angle = self.position_angle_deg
        if not isinstance(angle, int | float) or not math.isfinite(angle):
            raise InputError(f"expected position_angle_deg in deg in seasons, found {angle!r}")

    @property
    def start_mjd(self) -> float:
        """First day, MJD."""
        return _mjd(self.start)

    @property
    def end_mjd(self) -> float:
        """End of the season, MJD; no orbit starts later."""
        return _mjd(self.end)


def read_season(value: object) -> Season:
    """Return the season described by a mapping of its attributes.

    Raises
    ------
    InputError
        If an attribute is missing, unknown or invalid.
    """
    names = {item.name for item in fields(Season)}
    if not isinstance(value, Mapping) or set(value) != names:
        raise InputError(f"expected {', '.join(sorted(names))} in each season, found {value!r}")
    return Season(**value)


def _mjd(date: str) -> float:
    try:
        return float((dt.date.fromisoformat(date) - _MJD_ZERO).days)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"expected a date such as '2028-02-01' in seasons, found {date!r}"
        ) from error


# Table (exp:epoch); angles: section "Survey Design".
SEASONS = tuple(
    season
    for year in (2028, 2029, 2030)
    for season in (
        Season(f"{year}-02-01", f"{year}-05-01", 0.0),
        Season(f"{year}-08-01", f"{year}-11-01", 180.0),
    )
)
