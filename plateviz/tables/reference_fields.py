"""Table of the scatter of the reference stars between the fields of one orbit."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.chance import largest_by_chance
from plateviz.tables.focal_residuals import FocalResiduals, focal_residuals
from plateviz.tables.labels import id_strings
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.model.directions import tangent_frame, unproject
from solver.results.diagnosis.rate import log_chance, sigmas

_AXES = ("ra", "dec")
_COLUMNS = [
    *("id", "coordinate", "n_fields", "n", "scatter_mas", "expected_mas", "chi2", "dof"),
    *("sigmas", "level", "is_beyond"),
]
# Pointing along two axes, roll and focal length, which each field has for itself.
_OF_FIELD = 4.0


def reference_fields(result: FitResult, instrument: Instrument) -> pd.DataFrame:
    """Return the scatter of each reference star between fields, measured and expected.

    The position of a star in a field is its estimate plus the weighted mean of its residuals
    there. The scatter is the weighted rms of these about the weighted mean of all fields. Its
    chi2 has one degree of freedom less than there are fields, because the star's own position
    absorbs one: this is exact. The calibration absorbs as much, of all stars together, as it has
    parameters that move the fields against each other, or somewhat less where the catalogue
    determines some of them: below 1 % in a full orbit, and 4 to 6 % with a seventh of its
    measurements. Chi2 and the expected scatter are corrected by the share that is left.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the order of the detectors

    Returns
    -------
    A row per coordinate ("ra", "dec") and reference star that was measured in two fields or more,
    in ascending id: `id`, `coordinate`, `n_fields`, `n` (measurements), mas: `scatter_mas`,
    `expected_mas`; `chi2`, `dof`, and of both coordinates of the star together `sigmas` (those of
    a unit normal value that is as rare as chi2), `level` (of that, which the largest exceeds by
    chance in 1 %) and `is_beyond`. Empty for a single field, or if the calibration absorbs all
    """
    found = focal_residuals(result, instrument)
    field = pd.factorize(result.exposures["field_id"])[0][found.exposure]
    in_fields = _count_fields(found.source, field, len(result.sources))
    share = _share_left(result, int(field.max(initial=0)) + 1, in_fields)
    chosen = (in_fields > 1) & result.sources["is_reference"].to_numpy(bool)
    if share <= 0.0 or not chosen.any():
        return pd.DataFrame(columns=_COLUMNS)
    rows = np.flatnonzero(chosen[found.source])
    offset, weight = _on_sky(result, found, rows)
    tables = [
        _of_coordinate(found.source[rows], field[rows], offset[:, k], weight[:, k], share).assign(
            coordinate=axis
        )
        for k, axis in enumerate(_AXES)
    ]
    table = pd.concat(_with_chance(tables), ignore_index=True)
    ids = id_strings(result.sources["source_id"]).to_numpy()[table["source"]]
    return table.assign(id=ids)[_COLUMNS]


def _count_fields(source: np.ndarray, field: np.ndarray, n_sources: int) -> np.ndarray:
    """Return the number of fields in which each source was measured, shape (sources,)."""
    n_fields = int(field.max(initial=0)) + 1
    pairs = np.bincount(source * n_fields + field, minlength=n_sources * n_fields)
    return np.count_nonzero(pairs.reshape(n_sources, n_fields), axis=1)


def _share_left(result: FitResult, n_fields: int, in_fields: np.ndarray) -> float:
    """Return the share of the differences between fields that the calibration leaves.

    A parameter of a detector or of the distortion absorbs as much as its prior lets it.
    """
    fitted = sum(
        float((1.0 - result.values_on(axis, "prior_share")).sum().sum()) for axis in ("det", "coef")
    )
    dof = 2.0 * float(np.maximum(in_fields - 1, 0).sum())
    return 1.0 - (_OF_FIELD * (n_fields - 1) + fitted) / max(dof, 1.0)


def _on_sky(
    result: FitResult, found: FocalResiduals, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return residuals along East and North of their sources, and their weights.

    Parameters
    ----------
    rows : indices of n measurements

    Returns
    -------
    mas and mas^-2, both of shape (n, 2)
    """
    fitted = result.values_on("exp")
    pointing = [fitted[f"pointing_{axis}"].to_numpy() for axis in _AXES]
    angles = np.radians(fitted["position_angle"].to_numpy())
    # The axes of the focal plane of each exposure, as vectors on the sky.
    axes = np.stack(
        [
            unproject(np.eye(2), frame, angle, 1.0) - frame[0]
            for frame, angle in zip(tangent_frame(*pointing), angles, strict=True)
        ]
    )
    sky = tangent_frame(*(result.sources[axis].to_numpy() for axis in _AXES))[:, 1:]
    turn = axes[found.exposure[rows]] @ sky[found.source[rows]].transpose(0, 2, 1)
    offset = np.einsum("nik,ni->nk", turn, found.vector[rows])
    variance = np.einsum("nik,ni->nk", np.square(turn), 1.0 / found.weight[rows])
    return offset * found.mas_per_mpix, 1.0 / (variance * found.mas_per_mpix**2)


def _of_coordinate(
    source: np.ndarray, field: np.ndarray, offset: np.ndarray, weight: np.ndarray, share: float
) -> pd.DataFrame:
    """Return the rows of one coordinate, in ascending `source`, the index of the source.

    Parameters
    ----------
    source, field : of each measurement, shape (n,)
    offset, weight : of each measurement, mas and mas^-2, shape (n,)
    share : what the calibration leaves of chi2
    """
    rows = pd.DataFrame({"source": source, "field": field, "weight": weight, "n": 1})
    in_field = rows.assign(sum=weight * offset).groupby(["source", "field"]).sum()
    of_star = in_field.groupby("source")
    total = of_star.sum()
    place = in_field["sum"] / in_field["weight"]
    mean = (total["sum"] / total["weight"]).reindex(place.index, level="source")
    squares = (in_field["weight"] * np.square(place - mean)).groupby("source").sum()
    n_fields = of_star.size()
    return pd.DataFrame(
        {
            "n_fields": n_fields,
            "n": total["n"],
            "scatter_mas": np.sqrt(squares / total["weight"]),
            "expected_mas": np.sqrt(share * (n_fields - 1) / total["weight"]),
            "chi2": squares / share,
            "dof": n_fields - 1,
        }
    ).reset_index()


def _with_chance(tables: list[pd.DataFrame]) -> list[pd.DataFrame]:
    """Return the tables of both coordinates with the chance of each star, from both together."""
    both = np.sum([table[["chi2", "dof"]].to_numpy(float) for table in tables], axis=0)
    found = np.array([sigmas(log_chance(chi2, dof)) for chi2, dof in both])
    level = largest_by_chance(len(found))
    return [table.assign(sigmas=found, level=level, is_beyond=found > level) for table in tables]


class ReferenceFieldsStatistics(NamedTuple):
    """Summary of a table of `reference_fields`.

    Attributes
    ----------
    n : number of stars
    chi2, dof, scatter : sum over the stars and coordinates, and its mean and standard deviation
        by chance
    largest : `sigmas` of the star whose chi2 is rarest
    id : of this star
    limit : what the largest of so many exceeds in 1 % of orbits by chance
    n_beyond : number of stars beyond the limit
    """

    n: int
    chi2: float
    dof: float
    scatter: float
    largest: float
    id: str
    limit: float
    n_beyond: int


def reference_fields_statistics(table: pd.DataFrame) -> ReferenceFieldsStatistics:
    """Return the summary of a table of `reference_fields` that is not empty."""
    stars = table[table["coordinate"] == _AXES[0]]
    largest, dof = stars.loc[stars["sigmas"].idxmax()], float(table["dof"].sum())
    return ReferenceFieldsStatistics(
        n=len(stars),
        chi2=float(table["chi2"].sum()),
        dof=dof,
        scatter=float(np.sqrt(2.0 * dof)),
        largest=float(largest["sigmas"]),
        id=str(largest["id"]),
        limit=float(largest["level"]),
        n_beyond=int(stars["is_beyond"].sum()),
    )
