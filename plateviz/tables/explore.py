"""Tables whose columns can be drawn against each other: sources, measurements and exposures."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.exposures import minutes_since_first
from plateviz.tables.sources import chi2_per_dof, deviation, ordered_by_class
from solver.data import schema
from solver.data.columns import Column, Table
from solver.data.parameters import groups_on
from solver.data.result import FitResult

_CHI2_PER_DOF = Column("chi2_per_dof", "float64", "", "chi2 over its expectation")
# Not "time": astropy reads a FITS column of that name as a date.
_TIME = Column("minutes", "float64", "min", "time since the first exposure of the orbit")
_OF_DEVIATION = (
    Column("deviation_ra_mas", "float64", "mas", "estimate minus truth, ra cos(dec)"),
    Column("deviation_dec_mas", "float64", "mas", "estimate minus truth, dec"),
    Column("pull_ra", "float64", "", "deviation_ra_mas over the marginal sigma"),
    Column("pull_dec", "float64", "", "deviation_dec_mas over the marginal sigma"),
)
_OF_MEASUREMENTS = (
    Column("standardised", "float64", "", "length of (standardised_x, standardised_y)"),
    Column("phase_x", "float64", "pix", "measured x minus the next lower whole pixel"),
    Column("phase_y", "float64", "pix", "measured y minus the next lower whole pixel"),
    Column("n_obs", "int64", "", "number of measurements of the source"),
    _TIME,
)


class ExplorableTable(NamedTuple):
    """A table whose columns are read when they are asked for.

    Attributes
    ----------
    rows : what a row is, in the plural
    size : number of rows
    columns : name -> definition of the columns that are numbers, in the order to be offered
    read : name -> values of that column; `source_class` too, where `has_classes`
    has_sources : whether a row is of a source, so that there is a `source_id`
    has_classes : whether there is a `source_class`
    """

    rows: str
    size: int
    columns: Mapping[str, Column]
    read: Callable[[str], np.ndarray]
    has_sources: bool
    has_classes: bool

    def numbers(self, name: str) -> np.ndarray:
        """Return a column as floating-point numbers; KeyError if there is none of that name."""
        return self.read(self.columns[name].name).astype(float)


def explorable_sources(result: FitResult) -> ExplorableTable:
    """Return a row per source, with its deviation from the truth where that is known."""
    frame = ordered_by_class(result.sources)
    frame["chi2_per_dof"] = chi2_per_dof(frame)
    added = [_CHI2_PER_DOF]
    if result.true_places is not None:
        deviations = deviation(result, result.true_places)
        wanted = [column.name for column in _OF_DEVIATION]
        frame = frame.merge(deviations[["source_id", *wanted]], on="source_id", how="left")
        added += _OF_DEVIATION
    return _explorable("sources", frame, schema.SOURCES, added)


def explorable_measurements(result: FitResult) -> ExplorableTable:
    """Return a row per measurement, with the class of its source and the time of its exposure."""
    rows = result.residuals
    sources = ordered_by_class(result.sources).set_index("source_id")
    of_source = sources.index.get_indexer(rows["source_id"])
    frame = rows.assign(
        standardised=np.hypot(rows["standardised_x"], rows["standardised_y"]),
        phase_x=rows["nx"] - np.floor(rows["nx"]),
        phase_y=rows["ny"] - np.floor(rows["ny"]),
        n_obs=sources["n_obs"].to_numpy()[of_source],
        minutes=minutes_since_first(result.exposures)[result.exposure_index],
        source_class=sources["source_class"].to_numpy()[of_source],
    )
    return _explorable("measurements", frame, schema.RESIDUALS, _OF_MEASUREMENTS)


def explorable_exposures(result: FitResult) -> ExplorableTable:
    """Return a row per exposure, with its fitted parameters."""
    frame = result.exposures.assign(
        minutes=minutes_since_first(result.exposures), chi2_per_dof=chi2_per_dof(result.exposures)
    )
    added = [_TIME, _CHI2_PER_DOF]
    for kind, of_kind in (("offset", "estimate minus prior"), ("sigma_marginal", "marginal sigma")):
        values = result.values_on("exp", kind)
        for group in groups_on("exp"):
            name = f"{group.name}_{kind}"
            frame[name] = values[group.name].to_numpy()
            added.append(Column(name, "float64", group.unit, f"{group.label}, {of_kind}"))
    return _explorable("exposures", frame, schema.EXPOSURES, added)


EXPLORABLE: Mapping[str, Callable[[FitResult], ExplorableTable]] = MappingProxyType(
    {
        "measurements": explorable_measurements,
        "sources": explorable_sources,
        "exposures": explorable_exposures,
    }
)
"""What a row is -> function of a solution that returns the table."""


def sources_within(
    table: ExplorableTable, x: str, y: str, corners: np.ndarray, is_kept: np.ndarray
) -> frozenset[int]:
    """Return the ids of sources with a row inside a polygon.

    Parameters
    ----------
    table : of sources or measurements
    x, y : columns of the polygon's coordinates
    corners : of the polygon, which closes itself, (n, 2)
    is_kept : whether a row is drawn
    """
    if len(corners) < 3:
        return frozenset()
    low, high = corners.min(axis=0), corners.max(axis=0)
    places = np.stack([table.numbers(x), table.numbers(y)], axis=1)
    among = np.flatnonzero(np.all((places >= low) & (places <= high), axis=1) & is_kept)
    inside = among[_is_inside(places[among], corners)]
    return frozenset(np.unique(table.read("source_id")[inside]).tolist())


def _is_inside(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return whether each place is inside a polygon: a ray from it crosses the edge oddly often."""
    is_inside = np.zeros(len(places), dtype=bool)
    x, y = places.T
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crosses = (y0 > y) != (y1 > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            is_inside ^= crosses & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return is_inside


def _explorable(
    rows: str, frame: pd.DataFrame, table: Table, added: Iterable[Column]
) -> ExplorableTable:
    return ExplorableTable(
        rows,
        len(frame),
        {column.name: column for column in (*numbers_of(table), *added)},
        lambda name: frame[name].to_numpy(),
        "source_id" in frame,
        "source_class" in frame,
    )


def numbers_of(table: Table) -> list[Column]:
    """Return the columns of a table that are numbers, not names of sources or of the orbit."""
    names = ("source_id", "orbit_id")
    return [column for column in table if column.dtype != "str" and column.name not in names]
