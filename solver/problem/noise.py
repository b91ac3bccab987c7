"""Noise: an estimated noise model, and its application to the tables of an orbit."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.orbit import OrbitData

_CATALOGUE_ERRORS = ["ra_error", "dec_error", "parallax_error", "pmra_error", "pmdec_error"]


class Noise(NamedTuple):
    """An estimated noise model.

    Attributes
    ----------
    factor : by the label of a measurement, its uncertainty over the stated one
    floor : added in quadrature to the uncertainties of all measurements, pixel
    reference : uncertainties of the reference stars in the catalogue over the stated ones
    entry : the estimates, for the summary of a result
    """

    factor: pd.Series
    floor: float
    reference: float
    entry: dict[str, object]

    def applied(self, data: OrbitData) -> OrbitData:
        """Return the tables with the estimated uncertainties in place of the stated ones."""
        measurements, catalogue = data.measurements.copy(), data.catalogue.copy()
        factor = self.factor.reindex(measurements.index, fill_value=1.0).to_numpy()
        for name in ("sx", "sy"):
            measurements[name] = np.hypot(measurements[name] * factor, self.floor)
        chosen = catalogue["is_reference"].to_numpy(bool)
        for name in _CATALOGUE_ERRORS:
            catalogue.loc[chosen, name] = catalogue.loc[chosen, name] * self.reference
        return replace(data, measurements=measurements, catalogue=catalogue)
