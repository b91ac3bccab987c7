"""Tables of the footprint: sources and outlines of the fields on the sky."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.sky import centre_of, places_arcmin, sky_of_focal_plane
from plateviz.tables.sources import ordered_by_class
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.model.astrometry import sky_position
from solver.model.directions import tangent_frame


def footprint_sources(result: FitResult) -> pd.DataFrame:
    """Return the sources as offsets from the centre of the orbit's field.

    Returns
    -------
    `source_id`, `id` (text), `source_class`, `n_obs`, `ra`, `dec` (deg), `x_arcmin`
    (East positive) and `y_arcmin` in the plane tangent at the centre; reference sources last, so
    that they are drawn on top
    """
    table = ordered_by_class(result.sources)
    x, y = places_arcmin(table, centre_of(result.sources))
    columns = ["source_id", "source_class", "n_obs", "ra", "dec"]
    return table[columns].assign(id=id_strings(table["source_id"]), x_arcmin=x, y_arcmin=y)


def footprint_fields(result: FitResult, instrument: Instrument) -> pd.DataFrame:
    """Return the outline of each detector on the first exposure of each field.

    The nominal corners are projected with the fitted pointing, position angle and focal
    length; distortion (below a pixel) is neglected. The pointing refers to the observed,
    aberrated sky: each outline is moved by the mean difference between the observed and the
    estimated positions of the sources of its exposure, up to 0.35 arcmin.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the detectors' nominal corners

    Returns
    -------
    `field_id`, `plate_id`, `detector_id`, `corner` (0 to 4, closed), `ra`, `dec` (deg),
    `x_arcmin`, `y_arcmin`, as in `footprint_sources`
    """
    optics = result.values_on("exp")
    exposures = result.exposures.reset_index(drop=True)
    first = exposures.sort_values(["field_id", "plate_id"]).drop_duplicates("field_id")
    corners = np.concatenate([d.corners_um()[[0, 1, 2, 3, 0]] for d in instrument.detectors])
    frames = [
        _outline(corners, optics.loc[index], instrument, _observed(result, index))
        for index in first.index
    ]
    if not frames:
        return pd.DataFrame(columns=_FIELD_COLUMNS)
    table = pd.concat(frames, keys=first["field_id"], names=["field_id"]).reset_index(level=0)
    table["plate_id"] = table["field_id"].map(first.set_index("field_id")["plate_id"])
    table["x_arcmin"], table["y_arcmin"] = places_arcmin(table, centre_of(result.sources))
    return table[_FIELD_COLUMNS].reset_index(drop=True)


_FIELD_COLUMNS = [
    "field_id",
    "plate_id",
    "detector_id",
    "corner",
    "ra",
    "dec",
    "x_arcmin",
    "y_arcmin",
]


def _observed(result: FitResult, exposure: int) -> pd.DataFrame:
    """Return the positions of an exposure's sources on its ideal focal plane and on the sky.

    Parameters
    ----------
    exposure : its row in `result.exposures`
    """
    here, sources = np.flatnonzero(result.exposure_index == exposure), result.sources
    # Column by column: rows of the whole table would be copied.
    rows = {n: result.residuals[n].to_numpy()[here] for n in ("source_id", "ideal_x", "ideal_y")}
    found = np.searchsorted(sources["source_id"].to_numpy(), rows["source_id"])
    return pd.DataFrame(rows | {n: sources[n].to_numpy()[found] for n in ("ra", "dec")})


def _outline(
    corners: np.ndarray, pointing: pd.Series, instrument: Instrument, observed: pd.DataFrame
) -> pd.DataFrame:
    ra, dec = sky_of_focal_plane(corners, pointing)
    if len(observed):
        apparent = sky_of_focal_plane(observed[["ideal_x", "ideal_y"]].to_numpy(), pointing)
        here = _directions(observed["ra"].to_numpy(), observed["dec"].to_numpy())
        moved = (here - _directions(*apparent)).mean(axis=0)
        ra, dec = sky_position(_directions(ra, dec) + moved)
    ids = instrument.detector_ids
    return pd.DataFrame(
        {
            "detector_id": np.repeat(ids, 5),
            "corner": np.tile(np.arange(5), len(ids)),
            "ra": ra,
            "dec": dec,
        }
    )


def _directions(ra: np.ndarray, dec: np.ndarray) -> np.ndarray:
    return tangent_frame(ra, dec)[:, 0]
