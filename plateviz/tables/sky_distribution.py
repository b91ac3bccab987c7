"""Tables of the distribution of a catalogue's sources in Galactic coordinates."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.sources import ordered_by_class
from solver.simulate.sky import icrs_to_galactic
from solver.units import ARCMIN_PER_DEG

_SOURCES_PER_CELL = 4.0
_MOST_CELLS = 2500.0


def sky_distribution(catalogue: pd.DataFrame, truth: pd.DataFrame | None = None) -> pd.DataFrame:
    """Return the Galactic coordinates of the sources of a catalogue, by class.

    Parameters
    ----------
    catalogue : `schema.CATALOGUE`
    truth : `schema.TRUTH`; if given, the positions are taken from it and the classes from
        the catalogue

    Returns
    -------
    `id`, `source_class`, `l_deg`, unwrapped about the mean longitude, and `b_deg`
    """
    flags = catalogue[["source_id", "is_reference", "is_artificial"]]
    places = catalogue if truth is None else truth
    rows = ordered_by_class(flags.merge(places[["source_id", "ra", "dec"]], on="source_id"))
    if rows.empty:
        return pd.DataFrame(columns=["id", "source_class", "l_deg", "b_deg"])
    l_deg, b_deg = icrs_to_galactic(rows["ra"].to_numpy(), rows["dec"].to_numpy())
    return pd.DataFrame(
        {
            "id": id_strings(rows["source_id"]),
            "source_class": rows["source_class"],
            "l_deg": _unwrapped(l_deg),
            "b_deg": b_deg,
        }
    )


def sky_density(table: pd.DataFrame) -> pd.DataFrame:
    """Return the number of sources of a `sky_distribution` in cells of the sky.

    The cells divide the area covered by the sources, with a mean of at least four sources per
    cell.

    Parameters
    ----------
    table : not empty

    Returns
    -------
    A row per cell of the whole grid: `l_deg`, `b_deg` (centre), `n`, and `density`, sources
    per square arcmin; NaN for an empty cell
    """
    spans = [(float(table[name].min()), float(table[name].max())) for name in ("l_deg", "b_deg")]
    widths = [(high - low) or 1.0 for low, high in spans]
    cells = min(len(table) / _SOURCES_PER_CELL, _MOST_CELLS)
    size = (widths[0] * widths[1] / cells) ** 0.5
    edges = [
        np.linspace(low, low + width, 1 + max(1, round(width / size)))
        for (low, _), width in zip(spans, widths, strict=True)
    ]
    n, *_ = np.histogram2d(table["l_deg"], table["b_deg"], edges)
    l_deg, b_deg = np.meshgrid(*(0.5 * (e[1:] + e[:-1]) for e in edges), indexing="ij")
    steps = [float(e[1] - e[0]) * ARCMIN_PER_DEG for e in edges]
    area = steps[0] * steps[1] * np.cos(np.radians(b_deg))
    return pd.DataFrame(
        {
            "l_deg": l_deg.ravel(),
            "b_deg": b_deg.ravel(),
            "n": n.astype("int64").ravel(),
            "density": np.where(n > 0, n / area, np.nan).ravel(),
        }
    )


def _unwrapped(l_deg: np.ndarray) -> np.ndarray:
    """Return the longitudes within half a turn of their mean direction."""
    angle = np.radians(l_deg)
    centre = np.degrees(np.arctan2(np.sin(angle).mean(), np.cos(angle).mean()))
    return l_deg - 360.0 * np.round((l_deg - centre) / 360.0)
