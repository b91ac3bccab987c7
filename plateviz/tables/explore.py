"""Tables whose columns can be drawn against each other: sources, measurements and exposures."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from operator import attrgetter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.exposures import minutes_since_first
from plateviz.tables.labels import exposure_labels
from plateviz.tables.sources import chi2_per_dof, deviation, ordered_by_class
from solver.data import schema
from solver.data.columns import Column, Table
from solver.data.parameters import Group
from solver.data.result import FitResult

CHI2_PER_DOF = Column("chi2_per_dof", "float64", "", "chi2 over its expectation")
# Not "time": astropy reads a FITS column of that name as a date.
_TIME = Column("minutes", "float64", "min", "time since the first exposure of the orbit")
OF_DEVIATION = (
    Column("deviation_ra_mas", "float64", "mas", "estimate minus truth, ra cos(dec)"),
    Column("deviation_dec_mas", "float64", "mas", "estimate minus truth, dec"),
    Column("pull_ra", "float64", "", "deviation_ra_mas over the marginal sigma"),
    Column("pull_dec", "float64", "", "deviation_dec_mas over the marginal sigma"),
)
OF_MEASUREMENTS = (
    Column("standardised", "float64", "", "length of (standardised_x, standardised_y)"),
    Column("phase_x", "float64", "pix", "measured x minus the next lower whole pixel"),
    Column("phase_y", "float64", "pix", "measured y minus the next lower whole pixel"),
    Column("n_obs", "int64", "", "number of measurements of the source"),
    schema.SOURCES["magnitude"],
    _TIME,
)


class CodedSources(NamedTuple):
    """The source of each row, as its place among the sources of all rows.

    Attributes
    ----------
    ids : of the sources, ascending
    codes : place in `ids` of the source of each row
    classes : class of each source of `ids`; None if classes are unknown
    """

    ids: np.ndarray
    codes: np.ndarray
    classes: np.ndarray | None


class CodedItems(NamedTuple):
    """The source, the exposure or the detector of each row.

    Attributes
    ----------
    items : ids of sources or detectors, or (field_id, plate_id) of exposures
    codes : place in `items` of that of each row
    """

    items: list[Any]
    codes: np.ndarray

    def among(self, selected: Collection[Any]) -> np.ndarray:
        """Return whether each of `items` is selected."""
        return np.fromiter((one in selected for one in self.items), bool, len(self.items))


Words = Callable[[np.ndarray], np.ndarray]
"""Numbers of rows -> a text for each of these rows."""


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
    words : name -> what a hover says of rows besides their source and the drawn columns
    coded : returns the source of each row, where that is not derived from `source_id`
    note : what the rows leave out; empty if nothing
    """

    rows: str
    size: int
    columns: Mapping[str, Column]
    read: Callable[[str], np.ndarray]
    has_sources: bool
    has_classes: bool
    words: Mapping[str, Words] = MappingProxyType({})
    coded: Callable[[], CodedSources] | None = None
    note: str = ""

    @property
    def kinds(self) -> tuple[str, ...]:
        """What its rows are of that can be selected: sources, exposures, detectors.

        Exposures and detectors of several orbits are not the same.
        """
        is_of_orbit = "orbit_id" not in self.columns
        has = {
            "sources": self.has_sources,
            "exposures": is_of_orbit and {"field_id", "plate_id"} <= set(self.columns),
            "detectors": is_of_orbit and "detector_id" in self.columns,
        }
        return tuple(kind for kind, is_there in has.items() if is_there)

    def kind(self, wanted: str) -> str:
        """Return what is selected if `wanted` is to be; empty if its rows are of nothing."""
        return wanted if wanted in self.kinds else next(iter(self.kinds), "")

    def items(self, kind: str) -> CodedItems:
        """Return the source, exposure or detector of each row; `kind` is one of `kinds`."""
        if kind == "sources":
            sources = self.sources()
            return CodedItems(sources.ids.tolist(), sources.codes)
        names = ("field_id", "plate_id") if kind == "exposures" else ("detector_id",)
        rows = pd.DataFrame({name: self.read(name) for name in names})
        codes = rows.groupby(list(names), sort=False).ngroup().to_numpy()
        found = list(rows.drop_duplicates().itertuples(index=False, name=None))
        return CodedItems(found if kind == "exposures" else [one for (one,) in found], codes)

    def numbers(self, name: str) -> np.ndarray:
        """Return a column as floating-point numbers; KeyError if there is none of that name."""
        values = self.read(self.columns[name].name)
        return values if values.dtype.kind == "f" else values.astype(float)

    def sources(self) -> CodedSources:
        """Return the source of each row; only where `has_sources`."""
        if self.coded is not None:
            return self.coded()
        ids, first, codes = np.unique(
            self.read("source_id"), return_index=True, return_inverse=True
        )
        classes = self.read("source_class")[first] if self.has_classes else None
        return CodedSources(ids, codes, classes)


def explorable_sources(result: FitResult) -> ExplorableTable:
    """Return a row per source, with its deviation from the truth where that is known."""
    frame = ordered_by_class(result.sources)
    frame["chi2_per_dof"] = chi2_per_dof(frame)
    added = [CHI2_PER_DOF]
    if result.true_places is not None:
        deviations = deviation(result, result.true_places)
        wanted = [column.name for column in OF_DEVIATION]
        frame = frame.merge(deviations[["source_id", *wanted]], on="source_id", how="left")
        added += OF_DEVIATION
    return explorable("sources", frame, schema.SOURCES, added)


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
        # Results of old versions have no magnitudes.
        magnitude=sources.get("magnitude", sources["n_obs"] * np.nan).to_numpy()[of_source],
        minutes=minutes_since_first(result.exposures)[result.exposure_index],
        source_class=sources["source_class"].to_numpy()[of_source],
    )
    return explorable("measurements", frame, schema.RESIDUALS, OF_MEASUREMENTS)


def explorable_exposures(result: FitResult) -> ExplorableTable:
    """Return a row per exposure, with its fitted parameters."""
    frame = result.exposures.assign(
        minutes=minutes_since_first(result.exposures), chi2_per_dof=chi2_per_dof(result.exposures)
    )
    added = [_TIME, CHI2_PER_DOF]
    for one in fitted_columns(result.groups_on("exp")):
        frame[one.column.name] = result.values_on("exp", one.kind)[one.group].to_numpy()
        added.append(one.column)
    labels = exposure_labels(frame).to_numpy()
    words = {"exposure": labels.__getitem__}
    return explorable("exposures", frame, schema.EXPOSURES, added, words)


class FittedColumn(NamedTuple):
    """A column of the exposures that is a number of the calibration.

    Attributes
    ----------
    column : its definition
    group : name of the parameter group
    kind : column of `schema.CALIBRATION`
    """

    column: Column
    group: str
    kind: str


def fitted_columns(groups: Sequence[Group]) -> list[FittedColumn]:
    """Return the columns that parameter groups with a value per exposure give these."""
    return [
        FittedColumn(
            Column(name.format(group.name), "float64", unit(group), f"{group.label}, {of_kind}"),
            group.name,
            kind,
        )
        for kind, name, unit, of_kind in (
            ("value", "{}", attrgetter("value_unit"), "estimate"),
            ("offset", "{}_offset", attrgetter("unit"), "estimate minus prior"),
            ("sigma_marginal", "{}_sigma_marginal", attrgetter("unit"), "marginal sigma"),
        )
        for group in groups
    ]


EXPLORABLE: Mapping[str, Callable[[FitResult], ExplorableTable]] = MappingProxyType(
    {
        "measurements": explorable_measurements,
        "sources": explorable_sources,
        "exposures": explorable_exposures,
    }
)
"""What a row is -> function of a solution that returns the table."""


def explorable(
    rows: str,
    frame: pd.DataFrame,
    table: Table,
    added: Iterable[Column] = (),
    words: Mapping[str, Words] = MappingProxyType({}),
) -> ExplorableTable:
    """Return the table of a frame that is in memory.

    Parameters
    ----------
    rows : what a row is, in the plural
    table : definition of the columns
    added : definitions of the other columns to offer
    words : as in `ExplorableTable`
    """
    return ExplorableTable(
        rows,
        len(frame),
        {column.name: column for column in (*numbers_of(table), *added)},
        lambda name: frame[name].to_numpy(),
        "source_id" in frame,
        "source_class" in frame,
        words,
    )


def numbers_of(table: Table) -> list[Column]:
    """Return the columns of a table that are numbers, not names of sources or of the orbit."""
    names = ("source_id", "orbit_id")
    return [column for column in table if column.dtype != "str" and column.name not in names]
