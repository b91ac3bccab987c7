"""The published result layout: HDUs, and the published name of each result column.

The HDUs RESULT, SAMPLE, TELESCOPE, DETECTOR, DISTORTION and TRACE start with the columns of
the published files under their published names, followed by the other columns of this
project. TELESCOPE, DETECTOR and DISTORTION repeat values of CALIBRATION, for programs that
read the published layout.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from solver.data import eigenmode_schema as eigenmode_schema
from solver.data import schema
from solver.data.parameters import Axis, Published
from solver.data.result import FitResult
from solver.units import MAS_PER_DEG, factor_between, unit_named


@dataclass(frozen=True)
class PublishedTable:
    """Layout of one result table in an HDU.

    Attributes
    ----------
    hdu : name of the HDU
    table : definition of the table
    published : canonical name -> name in the file, if different
    unitless : canonical names of columns written without TUNIT, as in the published files
    """

    hdu: str
    table: schema.Table
    published: Mapping[str, str] = field(default_factory=dict)
    unitless: frozenset[str] = frozenset()

    def name(self, column: schema.Column) -> str:
        """Return the name of `column` in the file."""
        return self.published.get(column.name, column.name)


@dataclass(frozen=True)
class WrittenColumn:
    """A published column computed from other columns; written, never read.

    Attributes
    ----------
    name : name in the file
    unit : TUNIT; "" for none
    meaning : description in one line, with the unit
    values : one per row
    """

    name: str
    unit: str
    meaning: str
    values: np.ndarray


RESULT = PublishedTable(
    "RESULT",
    schema.SOURCES,
    {
        "ra": "src_a_loc",
        "dec": "src_d_loc",
        "prior_ra": "ra_ref",
        "prior_dec": "dec_ref",
        "n_obs": "num_measurement",
        "is_reference": "reference_flag",
        "corr_marginal": "src_ad_corr",
    },
)
SAMPLE = PublishedTable(
    "SAMPLE",
    schema.RESIDUALS,
    {
        "model_x": "ij_x",
        "model_y": "ij_y",
        "focal_x": "xy_x",
        "focal_y": "xy_y",
        "ideal_x": "pq_x",
        "ideal_y": "pq_y",
        "sx": "sig_x_loc",
        "sy": "sig_y_loc",
    },
    frozenset(f"{stem}{axis}" for stem in ("n", "model_", "focal_", "ideal_") for axis in "xy"),
)
CALIBRATION = PublishedTable("CALIBRATION", schema.CALIBRATION)
EXPOSURES = PublishedTable("EXPOSURES", schema.EXPOSURES)
TRUE_PLACES = PublishedTable("TRUE_PLACES", schema.TRUE_PLACES)
OUTLIERS = PublishedTable("OUTLIERS", schema.OUTLIERS)
ORDERS = PublishedTable("ORDERS", schema.ORDERS)
LOSSES = PublishedTable("LOSSES", schema.LOSSES)
MODES = PublishedTable("MODES", eigenmode_schema.EIGENMODES)
MODE_PARAMETERS = PublishedTable("MODE_PARAMETERS", eigenmode_schema.MODE_PARAMETERS)
MODE_SHIFTS = PublishedTable("MODE_SHIFTS", eigenmode_schema.MODE_SHIFTS)
TRACE = PublishedTable("TRACE", schema.TRACE, {"objective": "loss"})

PUBLISHED_ORDER = {
    "RESULT": (
        *("source_id", "src_a_loc", "src_a_sig", "src_d_loc", "src_d_sig", "ra_ref", "dec_ref"),
        *("num_measurement", "reference_flag"),
        *("src_a_marg", "src_d_marg", "src_ad_corr", "chi2", "dof", "is_artificial"),
    ),
    "SAMPLE": (
        *("source_id", "detector_id", "orbit_id", "field_id", "plate_id", "nx", "ny"),
        *("ij_x", "ij_y", "xy_x", "xy_y", "pq_x", "pq_y", "sig_x_loc", "sig_y_loc"),
    ),
    "TRACE": ("loss",),
    "DETECTOR": ("det_r_loc",),
}


def source_sigmas(sources: pd.DataFrame) -> list[WrittenColumn]:
    """Return the published sigmas of the sources, in degrees of RA and Dec."""
    cos_dec = np.cos(np.radians(sources["dec"].to_numpy()))
    columns = []
    for kind, suffix in (("conditional", "sig"), ("marginal", "marg")):
        for axis, letter, scale in (("ra", "a", cos_dec), ("dec", "d", 1.0)):
            sigma = sources[f"sigma_{axis}_{kind}"].to_numpy() / MAS_PER_DEG / scale
            meaning = f"[deg] {kind} sigma of {axis}, as a coordinate"
            columns.append(WrittenColumn(f"src_{letter}_{suffix}", "deg", meaning, sigma))
    return columns


def exposure_columns(result: FitResult) -> list[WrittenColumn]:
    """Return the columns of TELESCOPE: one row per exposure, in order."""
    rows = result.values_on("exp").index.to_numpy()
    exposures = result.exposures.iloc[rows]
    ids = [
        WrittenColumn(name, "", schema.EXPOSURES[name].meaning, exposures[name].to_numpy())
        for name in schema.EXPOSURES.key
    ]
    return ids + _calibration_columns(result, "exp")


def detector_columns(result: FitResult) -> list[WrittenColumn]:
    """Return the columns of DETECTOR: one row per detector, in order."""
    return _calibration_columns(result, "det")


def distortion_columns(result: FitResult) -> list[WrittenColumn]:
    """Return the columns of DISTORTION: one row per term, (2,0), (1,1), (0,2), (3,0)..."""
    return _calibration_columns(result, "coef")


# Axis -> HDU and prefix of the columns. Only TELESCOPE has TUNITs in the published files.
_HDUS: dict[Axis, tuple[str, str]] = {
    "exp": ("TELESCOPE", "tel"),
    "det": ("DETECTOR", "det"),
    "coef": ("DISTORTION", "opt"),
}


def _calibration_columns(result: FitResult, axis: Axis) -> list[WrittenColumn]:
    """Return the columns that the groups on an axis make, in the order of the published files."""
    hdu, prefix = _HDUS[axis]
    values = result.values_on(axis)
    columns: dict[str, WrittenColumn] = {}
    for group in result.groups_on(axis):
        value, unit = values[group.name].to_numpy(), group.value_unit
        named = [one for one in group.published if one.factor is None]
        for one in named or [Published(f"{prefix}_{group.name}_loc", group.label)]:
            shown = unit_named(unit).to_string("fits") if hdu == "TELESCOPE" else ""
            columns[one.column] = WrittenColumn(one.column, shown, f"[{unit}] {one.words}", value)
    for group in result.groups_on(axis):
        for one in group.published:
            if one.factor is not None:
                relative = one.factor * factor_between(group.value_unit, "") * values[group.name]
                changed = columns[one.column]
                columns[one.column] = replace(
                    changed, values=changed.values * (1.0 + relative.to_numpy())
                )
    rank = {name: number for number, name in enumerate(PUBLISHED_ORDER.get(hdu, ()))}
    return sorted(columns.values(), key=lambda one: rank.get(one.name, len(rank)))
