"""Residuals as vectors on the focal plane, with what the fitted sources absorb of them."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.results.diagnosis.rows import onto_focal_plane
from solver.units import MPIX_PER_PIX, RAD_PER_ARCMIN, RAD_PER_MAS, UM_PER_MM


class FocalResiduals(NamedTuple):
    """Residuals of n measurements as vectors along the axes of the focal plane.

    Attributes
    ----------
    exposure, detector : index into the exposures of the result and the detectors of the
        instrument, shape (n,)
    source : index into the sources of the result, shape (n,)
    at : place on the focal plane, mm, shape (n, 2)
    vector : measured minus predicted, mpix, shape (n, 2)
    weight : inverse variance of the measurement, mpix^-2, shape (n, 2)
    leverage : share of an error of the measurement that the fit absorbs, 0 to 1, shape (n,)
    source_variance : of the position of each source along one axis if the calibration is held
        fixed, mpix^2, shape (sources,)
    mas_per_mpix, arcmin_per_mm : on the sky
    """

    exposure: np.ndarray
    detector: np.ndarray
    source: np.ndarray
    at: np.ndarray
    vector: np.ndarray
    weight: np.ndarray
    leverage: np.ndarray
    source_variance: np.ndarray
    mas_per_mpix: float
    arcmin_per_mm: float

    def __len__(self) -> int:
        """Return the number of measurements."""
        return len(self.source)

    @property
    def free_weight(self) -> np.ndarray:
        """Weight times the share that is left in the residual, mpix^-2, shape (n, 2).

        It is the variance of the weighted residual, and the factor by which a displacement of
        this measurement alone enters it.
        """
        return self.weight * (1.0 - self.leverage)[:, None]

    def kept_by_sources(self, cells: np.ndarray, size: int) -> np.ndarray:
        """Return what the fitted positions of the sources leave of the weights in cells.

        A source absorbs the square of the sum of its weights in a cell, times the variance of its
        position. What is left is the variance of the sum of weighted residuals, and the factor by
        which a displacement of the cell enters it.

        Parameters
        ----------
        cells : of each measurement, shape (n,)
        size : number of cells

        Returns
        -------
        mpix^-2, shape (size, 2)
        """
        n_sources = len(self.source_variance)
        pair_of, pairs = pd.factorize(cells * n_sources + self.source)
        cell, source = np.divmod(pairs, n_sources)
        found = []
        for weight in self.weight.T:
            of_pair = np.bincount(pair_of, weight, minlength=len(pairs))
            absorbed = self.source_variance[source] * of_pair**2
            kept = np.bincount(cells, weight, minlength=size)
            found.append(kept - np.bincount(cell, absorbed, minlength=size))
        return np.stack(found, axis=-1)


def focal_residuals(result: FitResult, instrument: Instrument) -> FocalResiduals:
    """Return the residuals along the axes of the focal plane.

    A millipixel is a thousandth of the mean pixel pitch of the instrument, so that both axes and
    all detectors have one unit.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the order of the detectors
    """
    rows = result.residuals
    detector = instrument.index_of(rows["detector_id"].to_numpy())
    fitted = result.values_on("det")
    turn = np.radians(fitted["detector_rotation"].to_numpy())
    pitch_um = float(np.mean([(d.pitch_x_um, d.pitch_y_um) for d in instrument.detectors]))
    mpix = fitted[["pitch_x", "pitch_y"]].to_numpy()[detector] * (MPIX_PER_PIX / pitch_um)
    vector = rows[["residual_x", "residual_y"]].to_numpy() * mpix
    variance = np.square(rows[["sx", "sy"]].to_numpy() * mpix)
    focal_um = float(result.values_on("exp")["focal_length"].mean())
    mas_per_mpix = pitch_um / MPIX_PER_PIX / focal_um / RAD_PER_MAS
    sigmas = result.sources[["sigma_ra_conditional", "sigma_dec_conditional"]].to_numpy()
    ids = result.sources["source_id"].to_numpy()
    # Few are searched for: the ids of all measurements would take ten times as long.
    source, known = pd.factorize(rows["source_id"].to_numpy())
    c, s = np.cos(turn)[detector, None], np.sin(turn)[detector, None]
    return FocalResiduals(
        exposure=result.exposure_index,
        detector=detector,
        source=np.searchsorted(ids, known)[source],
        at=rows[["focal_x", "focal_y"]].to_numpy() / UM_PER_MM,
        vector=onto_focal_plane(vector, turn, detector),
        weight=1.0 / (c**2 * variance + s**2 * variance[:, ::-1]),
        leverage=np.clip(0.5 * rows["leverage"].to_numpy(), 0.0, 1.0),
        source_variance=np.mean(np.square(sigmas), axis=1) / mas_per_mpix**2,
        mas_per_mpix=mas_per_mpix,
        arcmin_per_mm=UM_PER_MM / focal_um / RAD_PER_ARCMIN,
    )
