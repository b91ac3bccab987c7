"""Tables of the calibration: the distortion as a vector field, and the fitted values."""

import numpy as np
import pandas as pd
from numpy.polynomial import legendre

from plateviz.tables.labels import element_labels, unit_text
from solver.data.distortion_terms import terms
from solver.data.instrument import Instrument
from solver.data.parameters import Axis
from solver.data.result import FitResult
from solver.units import RAD_PER_MAS, UM_PER_MM

_TITLES: tuple[tuple[str, Axis], ...] = (
    ("Exposures", "exp"),
    ("Detectors", "det"),
    ("Distortion", "coef"),
    ("Drift of the distortion", "drift"),
    ("Breathing of the distortion", "breathing"),
    ("Distortion of each field", "field"),
    ("Distortion of each detector", "own"),
    ("Random walk of the distortion", "walk"),
    ("Motion of the detectors", "motion"),
)


def distortion(result: FitResult, instrument: Instrument, *, grid: int = 17) -> pd.DataFrame:
    """Return the fitted distortion on a square grid that covers the detectors.

    Eq. (model:Lx) and Eq. (model:Ly), with the value at the optical centre subtracted:
    the displacement there is zero for every order, as in Eq. (model:A0) for order 5.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the scale s of the polynomials and the grid's extent
    grid : number of points along each axis; odd, so that the optical centre is one

    Returns
    -------
    Tail `x`, `y` and displacement `u`, `v` in mm, `mas_per_unit` (mas per mm), and the
    displacement as `dx_um`, `dy_um`, `dx_mas`, `dy_mas`
    """
    half = max(np.abs(d.corners_um()).max() for d in instrument.detectors)
    x, y = (a.ravel() for a in np.meshgrid(*[np.linspace(-half, half, grid)] * 2))
    scaled = x / instrument.distortion_scale_um, y / instrument.distortion_scale_um
    # A fit of order 0 or 1 has no such terms.
    fitted = result.values_on("coef").reindex(columns=["distortion_x", "distortion_y"])
    dx = displacement_um(fitted["distortion_x"].to_numpy(), *scaled)
    dy = displacement_um(fitted["distortion_y"].to_numpy(), *scaled)
    focal_um = float(result.values_on("exp")["focal_length"].mean())
    mas_per_um = 1.0 / focal_um / RAD_PER_MAS
    return pd.DataFrame(
        {
            "x": x / UM_PER_MM,
            "y": y / UM_PER_MM,
            "u": dx / UM_PER_MM,
            "v": dy / UM_PER_MM,
            "mas_per_unit": mas_per_um * UM_PER_MM,
            "dx_um": dx,
            "dy_um": dy,
            "dx_mas": dx * mas_per_um,
            "dy_mas": dy * mas_per_um,
        }
    )


def displacement_um(coefficients: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the Legendre sum minus its value at the origin.

    Parameters
    ----------
    coefficients : um, from degree 2, ordered by total degree, then by falling power of x
    x, y : scaled focal-plane coordinates, shape (n,)

    Returns
    -------
    um, shape (n,)

    Raises
    ------
    ValueError
        If the number of coefficients is not that of a complete order.
    """
    matrix = _coefficient_matrix(coefficients)
    return legendre.legval2d(x, y, matrix) - legendre.legval2d(0.0, 0.0, matrix)


def calibration_tables(result: FitResult) -> dict[str, pd.DataFrame]:
    """Return the fitted calibration for display, a table per axis.

    Returns
    -------
    "Exposures", "Detectors" and "Distortion" -> a row per exposure, detector or
    coefficient pair, named in the column `element`; for each group its value, marginal
    sigma and prior share. Column names give the unit in brackets. Of the axes of optional
    groups, those of the fit follow.
    """
    always = {"exp", "det", "coef"}
    return {
        title: _display_table(result, axis)
        for title, axis in _TITLES
        if axis in always or result.groups_on(axis)
    }


def _display_table(result: FitResult, axis: Axis) -> pd.DataFrame:
    groups = result.groups_on(axis)
    columns: dict[str, pd.Series] = {}
    wide = {
        name: result.values_on(axis, name) for name in ("value", "sigma_marginal", "prior_share")
    }
    for group in groups:
        unit, value_unit = (unit_text(u) for u in (group.unit, group.value_unit))
        columns[f"{group.label} [{value_unit}]"] = wide["value"][group.name]
        columns[f"σ {group.label}, marginal [{unit}]"] = wide["sigma_marginal"][group.name]
        columns[f"{group.label}, prior share"] = wide["prior_share"][group.name]
    table = pd.DataFrame(columns)
    table.insert(0, "element", element_labels(result.labels_on(axis).reindex(table.index)))
    return table.reset_index(drop=True)


def _coefficient_matrix(coefficients: np.ndarray) -> np.ndarray:
    order = 1
    while (order + 1) * (order + 2) // 2 - 3 < len(coefficients):
        order += 1
    if (order + 1) * (order + 2) // 2 - 3 != len(coefficients):
        raise ValueError(
            f"coefficients: expected those of a complete order (3, 7, 12, 18, ...), "
            f"found {len(coefficients)}"
        )
    matrix = np.zeros((order + 1, order + 1))
    for degrees, value in zip(terms(order), coefficients, strict=True):
        matrix[degrees] = value
    return matrix
