"""Stars of Gaia DR3 for the simulator: fetched once, then cached with the query."""

import hashlib
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
from astropy.table import Column, Table

from plateviz.cache import cache_directory
from plateviz.cli.tap_query import answer_to, service_name
from solver.data import columns
from solver.errors import InputError
from solver.io.atomic import require_writable, write_atomically
from solver.io.disk import writing
from solver.io.outputs import check_output
from solver.io.read_orbit import find_catalogue
from solver.io.table_check import conform
from solver.io.write_tables import SUFFIXES, write_tables
from solver.simulate.gaia import GAIA
from solver.simulate.settings import SurveySettings
from solver.simulate.sky import galactic_to_icrs

# The archive's row limit without a log-in; an answer with as many rows is truncated.
MOST_STARS = 3_000_000
_WHOLE_TURN_DEG = 360.0
_LARGEST_CIRCLE_DEG = 90.0
# A file without units and without the query is not kept.
_SUFFIXES = tuple(suffix for suffix in SUFFIXES if suffix != ".csv")

# The fetched columns: those that the simulator uses, and the magnitude for information.
ARCHIVE = columns.Table(
    "gaia_source",
    (
        *(replace(column, required=True, default=None) for column in GAIA),
        columns.Column("phot_g_mean_mag", "float64", "mag", "mean magnitude in G", may_be_nan=True),
    ),
    key=GAIA.key,
)


@dataclass(frozen=True)
class StarQuery:
    """The selection of stars to fetch.

    Attributes
    ----------
    l_deg, b_deg : limits in Galactic longitude, which may include zero, and latitude
    parallax_over_error : lower limit of the parallax over its error
    """

    l_deg: tuple[float, float]
    b_deg: tuple[float, float]
    parallax_over_error: float

    def __post_init__(self) -> None:
        """Raise InputError if the limits are not a field on the sky."""
        for name, (low, high) in (("l", self.l_deg), ("b", self.b_deg)):
            if not low < high or not np.isfinite([low, high]).all():
                raise InputError(f"--{name}: expected limits from low to high, found {low} {high}")
        if self.l_deg[1] - self.l_deg[0] > _WHOLE_TURN_DEG:
            raise InputError(
                f"--l: expected at most {_WHOLE_TURN_DEG:g} deg, found "
                f"{self.l_deg[1] - self.l_deg[0]:g}"
            )
        if self.b_deg[0] < -90.0 or self.b_deg[1] > 90.0:
            raise InputError(f"--b: expected latitudes from -90 to 90, found {self.b_deg}")

    @property
    def query(self) -> str:
        """The selection in ADQL, on one line; equal selections give equal text."""
        conditions = [*self._circle(), self._longitudes()]
        conditions += [
            f"b BETWEEN {self.b_deg[0]:.10g} AND {self.b_deg[1]:.10g}",
            f"parallax_over_error > {self.parallax_over_error:.10g}",
        ]
        return (
            f"SELECT TOP {MOST_STARS} {', '.join(ARCHIVE.names)} FROM gaiadr3.gaia_source "
            f"WHERE {' AND '.join(filter(None, conditions))} ORDER BY source_id"
        )

    def _longitudes(self) -> str:
        if self.l_deg[1] - self.l_deg[0] >= _WHOLE_TURN_DEG:
            return ""
        # Longitudes of the archive are from 0 to 360.
        low, high = (limit % _WHOLE_TURN_DEG for limit in self.l_deg)
        joint = "AND" if low < high else "OR"
        return f"(l >= {low:.10g} {joint} l <= {high:.10g})"

    def _circle(self) -> list[str]:
        """Return a circle that contains the field, because services index circles."""
        halves = [(high - low) / 2.0 for low, high in (self.l_deg, self.b_deg)]
        # The path along a meridian and then a parallel is at least as long as to any corner.
        radius = sum(halves)
        if radius > _LARGEST_CIRCLE_DEG:
            return []
        l_deg, b_deg = (np.array([sum(limits) / 2.0]) for limits in (self.l_deg, self.b_deg))
        ra, dec = (float(value[0]) for value in galactic_to_icrs(l_deg, b_deg))
        return [
            f"1 = CONTAINS(POINT('ICRS', ra, dec), CIRCLE('ICRS', {ra:.6f}, {dec:.6f}, "
            f"{radius + 1e-5:.6f}))"
        ]


class FetchedStars(NamedTuple):
    """Fetched stars, columns `ARCHIVE`, and whether they came from the cache.

    The table's `meta` holds QUERY, SERVICE and DATE, the time of the answer in UTC.
    """

    table: Table
    from_cache: bool


def star_query(
    l_deg: tuple[float, float] | None = None,
    b_deg: tuple[float, float] | None = None,
    parallax_over_error: float | None = None,
) -> StarQuery:
    """Return a selection; the defaults are those of the mini-mock's extended field."""
    survey = SurveySettings()
    margin = survey.field_margin_deg
    extended = [
        (low - margin, high + margin) for low, high in (survey.field_l_deg, survey.field_b_deg)
    ]
    return StarQuery(
        l_deg or extended[0],
        b_deg or extended[1],
        survey.parallax_over_error if parallax_over_error is None else parallax_over_error,
    )


def fetch_stars(chosen: StarQuery, url: str | None = None, refresh: bool = False) -> FetchedStars:
    """Return the stars of a selection, from the user's cache if they are in it.

    Parameters
    ----------
    url : address of a TAP service with the table gaiadr3.gaia_source; Gaia's by default
    refresh : query the service even if the stars are in the cache

    Raises
    ------
    InputError
        If the query fails, its answer is truncated or lacks columns, or the cache cannot be
        written.
    """
    kept = cached_file(chosen, url)
    if kept.is_file() and not refresh and (table := _read(kept)) is not None:
        return FetchedStars(table, from_cache=True)
    with writing(kept.parent, "to create the folder"):
        kept.parent.mkdir(parents=True, exist_ok=True)
    require_writable(kept)
    table = _fetch(chosen.query, url)
    write_stars(table, kept, overwrite=True)
    return FetchedStars(table, from_cache=False)


def cached_file(chosen: StarQuery, url: str | None = None) -> Path:
    """Return the cache file of a selection; it need not exist."""
    digest = hashlib.sha256(f"{url or ''}\n{chosen.query}".encode()).hexdigest()
    return cache_directory() / "gaia" / f"{digest[:32]}.parquet"


def require_new_table(path: Path, overwrite: bool) -> None:
    """Raise InputError if the stars cannot be written to `path`, or must not replace it."""
    check_output(path, _SUFFIXES, overwrite=overwrite)


def write_stars(table: Table, path: Path, overwrite: bool = False) -> None:
    """Write fetched stars, with query, service and date, in the format of the suffix.

    Raises
    ------
    InputError
        If the suffix is not a known format, the file cannot be written, or it exists and is not
        to be overwritten.
    """
    require_new_table(path, overwrite)
    with write_atomically(path, overwrite) as temporary:
        write_tables({ARCHIVE.name: table}, temporary)


def _read(kept: Path) -> Table | None:
    """Return cached stars; None if the file is damaged, so that they are fetched again."""
    try:
        return find_catalogue(kept).table
    except InputError:
        return None


def _fetch(query: str, url: str | None) -> Table:
    name = service_name(url)
    raw = answer_to(query, url)
    if not 0 < len(raw) < MOST_STARS:
        raise InputError(
            f"{name}: expected from 1 to {MOST_STARS - 1} stars, found {len(raw)} of {query}"
        )
    for column in raw.itercols():
        if column.dtype.kind == "f" and np.ma.is_masked(column):
            raw[column.name] = column.filled(np.nan)
    stars = conform(raw, ARCHIVE, name)
    date = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
    table = Table(meta={"QUERY": query, "SERVICE": name, "DATE": date})
    for column in ARCHIVE:
        table[column.name] = Column(
            stars[column.name].to_numpy(), unit=column.unit or None, description=column.meaning
        )
    return table
