"""The calibration of a solution as tables for files, with all digits, units and meanings."""

from collections.abc import Mapping
from types import MappingProxyType

from astropy.table import Column, Table

from plateviz.dashboard.saving.downloads import described
from solver.data.parameter_group import Axis
from solver.data.result import FitResult
from solver.data.schema import CALIBRATION, EXPOSURES, OUTLIERS

_NAMES: Mapping[Axis, str] = MappingProxyType(
    {
        "exp": "exposures",
        "det": "detectors",
        "coef": "distortion",
        "drift": "distortion_drift",
        "breathing": "distortion_breathing",
        "field": "field_distortion",
        "own": "detector_distortion",
        "walk": "distortion_walk",
        "motion": "detector_motion",
    }
)
# Units of these columns are those of the group's value; those of the others of its sigmas.
_OF_VALUE = ("value", "prior_centre")
_WITHOUT_UNIT = ("prior_share",)


def calibration_files(result: FitResult) -> dict[str, Table]:
    """Return the tables of the Calibration workspace.

    Returns
    -------
    A table for each axis of the calibration, with columns such as `focal_length_value` of each of
    its groups, and that of the outliers, if the fit searched for some
    """
    tables = {name: _of_axis(result, axis) for axis, name in _NAMES.items()}
    if result.outliers is not None:
        tables["outliers"] = described(result.outliers, OUTLIERS)
    return {name: table for name, table in tables.items() if len(table)}


def _of_axis(result: FitResult, axis: Axis) -> Table:
    groups = result.groups_on(axis)
    if not groups:
        return Table()
    found = described(result.exposures, EXPOSURES) if axis == "exp" else Table()
    labels = result.labels_on(axis)
    found["element"] = labels.index.to_numpy()
    found["label"] = labels.to_numpy().astype(str)
    for column in CALIBRATION:
        if column.dtype != "float64":
            continue
        values = result.values_on(axis, column.name)
        for group in groups:
            unit = group.value_unit if column.name in _OF_VALUE else group.unit
            found[f"{group.name}_{column.name}"] = Column(
                values[group.name].to_numpy(),
                unit="" if column.name in _WITHOUT_UNIT else unit,
                description=f"{group.label}: {column.meaning.split(', in ')[0]}",
            )
    return found
