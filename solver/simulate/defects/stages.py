"""The defects of a survey, applied stage by stage; without any, nothing is changed."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.columns import numpy_dtype
from solver.data.defect_schema import AFFECTED
from solver.simulate.defects.defect import (
    Altered,
    AppliedDefect,
    Defect,
    DefectStage,
    TrueRows,
)
from solver.simulate.defects.table import BY_NAME
from solver.simulate.settings import SurveySettings
from solver.units import factor_between

_AFFECTED_TYPES = {column.name: numpy_dtype(column) for column in AFFECTED}


def none_affected() -> pd.DataFrame:
    """Return `AFFECTED` without rows."""
    return pd.DataFrame({name: np.empty(0, kind) for name, kind in _AFFECTED_TYPES.items()})


def has_stage(settings: SurveySettings, *stages: DefectStage) -> bool:
    """Return whether a survey has defects of any of the stages."""
    return any(BY_NAME[name].stage in stages for name in settings.amplitudes)


def applied_defects(
    settings: SurveySettings, stage: DefectStage, orbit_id: int = 0
) -> Iterator[tuple[Defect, AppliedDefect]]:
    """Yield the defects of a stage in the order of the table."""
    for name, amplitude in settings.amplitudes.items():
        defect = BY_NAME[name]
        if defect.stage is stage:
            factor = factor_between(defect.unit, defect.computed_in)
            yield defect, AppliedDefect(name, amplitude * factor, settings, orbit_id)


def defective_catalogue(
    catalogue: pd.DataFrame, truth: pd.DataFrame, settings: SurveySettings
) -> Altered:
    """Return the reference catalogue with its defects, and the sources affected.

    Parameters
    ----------
    catalogue, truth : with the same sources in the same order
    """
    parts = [none_affected()]
    for defect, applied in applied_defects(settings, DefectStage.CATALOGUE):
        catalogue, affected = defect.apply(applied, catalogue, truth)
        parts.append(_named(affected, defect))
    return Altered(catalogue, pd.concat(parts, ignore_index=True))


def true_observer(attitude: pd.DataFrame, settings: SurveySettings, orbit_id: int) -> pd.DataFrame:
    """Return the attitude as it is, where the one without defects is what is recorded."""
    for defect, applied in applied_defects(settings, DefectStage.OBSERVER, orbit_id):
        attitude = defect.apply(applied, attitude)
    return attitude


def focal_displacement(
    rows: TrueRows, settings: SurveySettings, orbit_id: int
) -> Float[np.ndarray, "obs 2"]:
    """Return the displacement on the focal plane, um."""
    total = np.zeros_like(rows.ideal)
    for defect, applied in applied_defects(settings, DefectStage.FOCAL_PLANE, orbit_id):
        total += defect.apply(applied, rows)
    return total


def displaced_pixels(
    rows: TrueRows, settings: SurveySettings, orbit_id: int
) -> Float[np.ndarray, "obs 2"]:
    """Return the positions on the detectors with all defects in the table's order, pixels."""
    for defect, applied in applied_defects(settings, DefectStage.DETECTOR, orbit_id):
        rows = replace(rows, pixel=rows.pixel + defect.apply(applied, rows))
    return rows.pixel


def noise_ratio(
    rows: TrueRows, settings: SurveySettings, orbit_id: int
) -> Float[np.ndarray, " obs"]:
    """Return the noise over the stated uncertainty, a factor that applies to both axes."""
    ratio = np.ones(len(rows.exposure))
    for defect, applied in applied_defects(settings, DefectStage.NOISE, orbit_id):
        ratio = ratio * defect.apply(applied, rows)
    return ratio


def defective_table(table: pd.DataFrame, settings: SurveySettings, orbit_id: int) -> Altered:
    """Return the table of measurements with its defects, and the measurements affected."""
    parts = [none_affected()]
    for defect, applied in applied_defects(settings, DefectStage.MEASUREMENTS, orbit_id):
        table, affected = defect.apply(applied, table)
        parts.append(_named(affected, defect))
    return Altered(table, pd.concat(parts, ignore_index=True))


def recorded_exposures(
    exposures: pd.DataFrame, settings: SurveySettings, orbit_id: int
) -> pd.DataFrame:
    """Return the table of exposures of an orbit as it is recorded."""
    for defect, applied in applied_defects(settings, DefectStage.EXPOSURES, orbit_id):
        exposures = defect.apply(applied, exposures)
    return exposures


def _named(affected: pd.DataFrame, defect: Defect) -> pd.DataFrame:
    return affected.assign(defect=defect.name)[AFFECTED.names].astype(_AFFECTED_TYPES)
