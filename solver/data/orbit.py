"""OrbitData: the checked input tables of one orbit, as pandas frames in canonical units."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import pandas as pd


@dataclass(frozen=True)
class OrbitData:
    """Input tables of one orbit; columns and units as in `solver.data.schema`.

    Attributes
    ----------
    measurements : `schema.MEASUREMENT`, any row order
    exposures : `schema.ENVIRONMENT`, one row per exposure with measurements. An exposure
        without measurements would make the fit singular: its position angle has a flat prior
    catalogue : `schema.CATALOGUE`, at least every measured source
    truth : `schema.TRUTH`, or None if there is no truth
    provenance : file name -> SHA-256 of each file read
    """

    measurements: pd.DataFrame
    exposures: pd.DataFrame
    catalogue: pd.DataFrame
    truth: pd.DataFrame | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)

    @property
    def orbit_id(self) -> int:
        """The orbit that the measurements belong to."""
        return int(self.measurements["orbit_id"].iloc[0])
