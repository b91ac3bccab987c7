"""Statistics of one orbit from which a survey tells errors of the catalogue from distortion.

A smooth field of errors of the reference catalogue, a zonal error, does three things to the
solution of an orbit. The reference stars deviate from their entries, as far as no calibration can
follow the field. The frame follows the rest, and with it all other stars, as far as shifts, turns,
scales and quadratic terms do; in another part of the sky it follows differently. And the
distortion follows, with a sign that depends on the position angle. The statistics are slopes of
the log posterior along polynomial fields on the sky, the polynomial that the frame follows, and
the quadratic terms of the distortion. All are linear in the errors of the catalogue, and the
response to them is kept for each reference star, because orbits share these errors.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import scipy.linalg as sl
from jaxtyping import Bool, Float

from solver.data.result import FitResult
from solver.data.run_schema import (
    FIELD_DEGREES,
    FRAME_DEGREES,
    SKY_RESPONSES,
    SKY_STATISTICS,
)
from solver.linear.source_elimination import ReducedSystem
from solver.model.correlation import square_roots
from solver.model.directions import mean_direction, places_about
from solver.problem.problem import Problem
from solver.results.diagnostics import induced_shift

# Fewer stars that are no reference stars do not say how the frame follows.
_LEAST_STARS = 2 * len(FRAME_DEGREES)
# Coefficients of the quadratic terms of the distortion along one axis.
_QUADRATIC = 3


def sky_statistics(
    problem: Problem, reduced: ReducedSystem, result: FitResult
) -> dict[str, pd.DataFrame]:
    """Return `SKY_STATISTICS` and `SKY_RESPONSES` of a solution, by name of the table.

    Parameters
    ----------
    reduced : the problem linearised at the solution
    result : the solution

    Returns
    -------
    No tables if too few stars are no reference stars.
    """
    is_reference = problem.sources["is_reference"].to_numpy(bool)
    if (~is_reference).sum() < _LEAST_STARS:
        return {}
    references, precision = problem.sources[is_reference], problem.priors.precision
    centre = mean_direction(references["ra"].to_numpy(), references["dec"].to_numpy())
    at = places_about(centre, *problem.sources[["ra", "dec"]].to_numpy().T)
    fields = polynomial_fields(at, FIELD_DEGREES) * is_reference[:, None]
    rows = np.concatenate([_distortion_rows(problem), _frame_rows(reduced, at, ~is_reference)])
    covariance, by_rows = _of_calibration(problem, reduced, rows)
    # By how much less the estimates move than the catalogue, along each field.
    lag = induced_shift(reduced, problem.priors, fields) - fields
    response = np.concatenate([by_rows, np.einsum("sij,fsj->fsi", precision, lag)])
    response = response[:, is_reference]
    by_field = np.einsum("fsi,gsi->fg", response, fields[:, is_reference])
    # The slopes vary with the data as minus their response to the field.
    total = sl.block_diag(covariance, -by_field[len(covariance) :])
    root = square_roots(np.linalg.inv(precision[is_reference]))
    by_star = np.einsum("fsi,sij->fsj", response, root)
    noise = total - np.einsum("fsi,gsi->fg", by_star, by_star)
    offset = result.sources[["offset_ra", "offset_dec"]].to_numpy()
    slopes = np.einsum("fsi,sij,sj->f", fields, precision, offset)
    values = {
        "distortion": _distortion(result),
        "frame": np.zeros(2 * len(FRAME_DEGREES)),
        "field": slopes,
    }
    return {
        SKY_STATISTICS.name: _statistics(values, by_field, noise, centre),
        SKY_RESPONSES.name: _responses(references["source_id"].to_numpy(), by_star),
    }


def polynomial_fields(
    at: Float[np.ndarray, "star 2"], degrees: Sequence[tuple[int, int]]
) -> Float[np.ndarray, "field star 2"]:
    """Return displacements of 1 mas times a monomial, first those to the East, then to the North.

    Parameters
    ----------
    at : positions, deg to the East and North
    degrees : of the monomials
    """
    values = np.array([at[:, 0] ** i * at[:, 1] ** j for i, j in degrees])
    fields = np.zeros((2, len(values), len(at), 2))
    fields[0, :, :, 0] = fields[1, :, :, 1] = values
    return fields.reshape(-1, len(at), 2)


def _distortion_rows(problem: Problem) -> Float[np.ndarray, "term calib"]:
    layout = problem.layout
    columns = np.concatenate([layout.columns(one)[:_QUADRATIC] for one in layout.on("coef")])
    return np.eye(layout.size)[columns]


def _frame_rows(
    reduced: ReducedSystem, at: Float[np.ndarray, "src 2"], fitted: Bool[np.ndarray, " src"]
) -> Float[np.ndarray, "frame calib"]:
    """Return the polynomial that the sources' shifts follow, per unit of each parameter.

    Parameters
    ----------
    fitted : the sources whose shifts it fits
    """
    fields = polynomial_fields(at, FRAME_DEGREES) * fitted[:, None]
    whitened = np.einsum("sji,fsj->fis", reduced.source_factor, fields)
    normal = np.einsum("fis,gis->fg", whitened, whitened)
    # The shifts are -L'^-1 Z'; the whitened fields are L' times the fields.
    return -np.linalg.solve(normal, reduced.onto_calibration(whitened))


def _of_calibration(
    problem: Problem, reduced: ReducedSystem, rows: Float[np.ndarray, "row calib"]
) -> tuple[Float[np.ndarray, "row row"], Float[np.ndarray, "row src 2"]]:
    """Return the covariance of functions of the calibration, and their response to priors."""
    nothing = np.zeros((problem.n_src, 2))
    solved = [reduced.solve(row, nothing) for row in rows]
    covariance = rows @ np.array([theta for theta, _ in solved]).T
    cross = np.array([shifts for _, shifts in solved])
    return covariance, np.einsum("fsi,sij->fsj", cross, problem.priors.precision)


def _distortion(result: FitResult) -> Float[np.ndarray, " term"]:
    rows = result.calibration
    parts = [rows.loc[rows["group"] == f"distortion_{axis}", "value"] for axis in "xy"]
    return np.concatenate([part.to_numpy()[:_QUADRATIC] for part in parts])


def _statistics(
    values: dict[str, np.ndarray],
    by_field: np.ndarray,
    noise: np.ndarray,
    centre: tuple[float, float],
) -> pd.DataFrame:
    columns: dict[str, object] = {
        "kind": [kind for kind, part in values.items() for _ in part],
        "element": [number for part in values.values() for number in range(len(part))],
        "value": np.concatenate([*values.values()]),
        "centre_ra": centre[0],
        "centre_dec": centre[1],
    }
    columns |= {f"field_{number:02d}": column for number, column in enumerate(by_field.T)}
    columns |= {f"noise_{number:02d}": column for number, column in enumerate(noise.T)}
    # Solutions without quadratic terms have fewer statistics.
    return pd.DataFrame(columns).reindex(columns=SKY_STATISTICS.names, fill_value=0.0)


def _responses(source_id: np.ndarray, by_star: np.ndarray) -> pd.DataFrame:
    columns: dict[str, np.ndarray] = {"source_id": source_id}
    for axis, values in zip(("ra", "dec"), by_star.transpose(2, 0, 1), strict=True):
        columns |= {f"{axis}_{number:02d}": row for number, row in enumerate(values)}
    return pd.DataFrame(columns).reindex(columns=SKY_RESPONSES.names, fill_value=0.0)
