"""OrbitData: the checked input tables of one orbit, as pandas frames in canonical units."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import pandas as pd


@dataclass(frozen=True)
class OrbitData:
    """Everything that a fit of one orbit reads; columns and units as in `solver.data.schema`.

    Attributes
    ----------
    measurements : `schema.MEASUREMENT`, any row order
    exposures : `schema.ENVIRONMENT`, one row per exposure with measurements: one without
        has no roll, whose prior is flat, and a fit would say that the system is singular
    catalogue : `schema.CATALOGUE`, at least every measured source
    truth : `schema.TRUTH`, or None where there is no truth
    provenance : file name -> SHA-256 of what was read
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
