"""SkyOrbit: what one orbit says about errors of the catalogue, about a centre common to all."""

from collections.abc import Sequence
from math import comb
from typing import NamedTuple

import numpy as np
import pandas as pd
import scipy.linalg as sl
from jaxtyping import Float, Int

from solver.data.run_schema import FIELD_DEGREES, FRAME_DEGREES
from solver.model.directions import mean_direction, places_about

N_FRAME, N_FIELDS = 2 * len(FRAME_DEGREES), 2 * len(FIELD_DEGREES)


class SkyOrbit(NamedTuple):
    """Statistics of one orbit, as in `run_schema.SKY_STATISTICS`.

    The rows are the terms of the distortion, the polynomial of the frame, and the fields.

    Attributes
    ----------
    epoch : MJD in TCB
    n_terms : number of the terms of the distortion
    values : of the rows
    by_field : change of the rows per mas of each field
    noise : covariance of the rows, from the noise
    by_star : change of the rows per sigma of each reference star's catalogue error
    source_id : of these stars
    """

    epoch: float
    n_terms: int
    values: Float[np.ndarray, " row"]
    by_field: Float[np.ndarray, "row field"]
    noise: Float[np.ndarray, "row row"]
    by_star: Float[np.ndarray, "row star 2"]
    source_id: Int[np.ndarray, " star"]


class OrbitTables(NamedTuple):
    """The tables of one orbit: its epoch, `SKY_STATISTICS` and `SKY_RESPONSES`."""

    epoch: float
    statistics: pd.DataFrame
    responses: pd.DataFrame


def common_centre(tables: Sequence[OrbitTables]) -> tuple[float, float]:
    """Return the mean of the orbits' centres, deg."""
    return mean_direction(*_centres(tables).T)


def sky_orbits(tables: Sequence[OrbitTables], centre: tuple[float, float]) -> list[SkyOrbit]:
    """Return the statistics of the orbits, with polynomials about one centre, deg."""
    shifts = places_about(centre, *_centres(tables).T)
    return [_moved(one, shift) for one, shift in zip(tables, shifts, strict=True)]


def _centres(tables: Sequence[OrbitTables]) -> Float[np.ndarray, "orbit 2"]:
    return np.array([one.statistics[["centre_ra", "centre_dec"]].iloc[0] for one in tables])


def _moved(tables: OrbitTables, shift: Float[np.ndarray, " 2"]) -> SkyOrbit:
    statistics, responses = tables.statistics, tables.responses
    n_rows = len(statistics)
    n_terms = n_rows - N_FRAME - N_FIELDS
    of_fields = shifted_monomials(shift, FIELD_DEGREES)
    # A polynomial's coefficients change by the inverse of what its monomials change by.
    of_frame = np.linalg.inv(shifted_monomials(shift, FRAME_DEGREES))
    change = sl.block_diag(np.eye(n_terms), of_frame, of_fields.T)
    by_field = statistics[[f"field_{k:02d}" for k in range(N_FIELDS)]].to_numpy()
    noise = statistics[[f"noise_{k:02d}" for k in range(n_rows)]].to_numpy()
    by_star = np.stack(
        [responses[[f"{axis}_{k:02d}" for k in range(n_rows)]].to_numpy() for axis in ("ra", "dec")]
    )
    return SkyOrbit(
        tables.epoch,
        n_terms,
        change @ statistics["value"].to_numpy(),
        change @ by_field @ of_fields,
        change @ noise @ change.T,
        np.einsum("fg,asg->fsa", change, by_star),
        responses["source_id"].to_numpy(),
    )


def shifted_monomials(
    shift: Float[np.ndarray, " 2"], degrees: Sequence[tuple[int, int]]
) -> Float[np.ndarray, "field field"]:
    """Return each monomial of a position plus `shift`, a column each, by monomials of it.

    Both for displacements to the East and to the North.
    """
    matrix = np.zeros((len(degrees), len(degrees)))
    for column, (i, j) in enumerate(degrees):
        for row, (k, m) in enumerate(degrees):
            if k <= i and m <= j:
                number = comb(i, k) * comb(j, m)
                matrix[row, column] = number * shift[0] ** (i - k) * shift[1] ** (j - m)
    return np.kron(np.eye(2), matrix)
