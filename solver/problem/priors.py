"""Priors of the calibration parameters and the sources, in offsets from their origins.

Paper, table "Inputs, Model Parameters, and Priors", and Eq. (exp:priors). The centre of
every prior is the parameter's origin, so that its offset is zero there. The default widths are in
the table of parameter groups, `solver.data.parameters`.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.data.parameters import BY_NAME
from solver.data.settings import FitSettings


class Priors(NamedTuple):
    """Independent priors of the calibration parameters, and a Gaussian prior per source.

    `centre` is the absolute value at offset zero, used by gamma priors; `width` the standard
    deviation, `inf` where flat; `precision` the inverse covariance of (alpha*, delta),
    mas^-2.
    """

    centre: Float[np.ndarray, " calib"]
    width: Float[np.ndarray, " calib"]
    is_gamma: Bool[np.ndarray, " calib"]
    precision: Float[np.ndarray, "src 2 2"]

    def penalty(
        self, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
    ) -> float:
        """Return minus twice the logarithm of the prior density, zero at the centres."""
        normal = np.where(self.is_gamma, 0.0, (theta / self.width) ** 2)
        source_penalty = np.einsum("si,sij,sj->", sources, self.precision, sources)
        return float(normal.sum() + self._gamma_penalty(theta) + source_penalty)

    def log_normalisation(self) -> float:
        """Return the logarithm of the prior density at the centres.

        Flat priors are improper and count as density one per unit. Gamma priors count as
        normal ones, which at their widths here is accurate to a part in a million.
        """
        finite = self.width[np.isfinite(self.width)]
        log_calibration = -np.sum(np.log(finite) + 0.5 * np.log(2.0 * np.pi))
        log_sources = 0.5 * np.linalg.slogdet(self.precision)[1].sum()
        return float(log_calibration + log_sources - len(self.precision) * np.log(2.0 * np.pi))

    def gradient(self, theta: Float[np.ndarray, " calib"]) -> Float[np.ndarray, " calib"]:
        """Return the derivative of half the penalty with respect to the calibration."""
        slope = theta / self.width**2
        shape, value = self._gamma(theta)
        slope[self.is_gamma] = 1.0 / self._gamma_scale() - (shape - 1.0) / value
        return slope

    def source_gradient(self, sources: Float[np.ndarray, "src 2"]) -> Float[np.ndarray, "src 2"]:
        """Return the derivative of half the penalty with respect to the sources."""
        return np.einsum("sij,sj->si", self.precision, sources)

    def hessian_diagonal(self, theta: Float[np.ndarray, " calib"]) -> Float[np.ndarray, " calib"]:
        """Return the second derivative of half the penalty with respect to the calibration."""
        prior_hessian = self.width**-2.0
        shape, value = self._gamma(theta)
        prior_hessian[self.is_gamma] = (shape - 1.0) / value**2
        return prior_hessian

    def _gamma_scale(self) -> Float[np.ndarray, " gamma"]:
        return self.width[self.is_gamma] ** 2 / self.centre[self.is_gamma]

    def _gamma(
        self, theta: Float[np.ndarray, " calib"]
    ) -> tuple[Float[np.ndarray, " gamma"], Float[np.ndarray, " gamma"]]:
        centre = self.centre[self.is_gamma]
        return centre / self._gamma_scale(), centre + theta[self.is_gamma]

    def _gamma_penalty(self, theta: Float[np.ndarray, " calib"]) -> float:
        shape, value = self._gamma(theta)
        # The density vanishes at or below zero: the engine shortens such a step.
        if (value <= 0.0).any():
            return np.inf
        centre, offset = self.centre[self.is_gamma], theta[self.is_gamma]
        logarithm = (shape - 1.0) * np.log(value / centre)
        return float(2.0 * np.sum(offset / self._gamma_scale() - logarithm))


def group_widths(
    settings: FitSettings, centres: dict[str, Float[np.ndarray, " _"]]
) -> dict[str, Float[np.ndarray, " _"]]:
    """Return the prior widths of every calibration group, in the group's unit.

    Parameters
    ----------
    centres : group name -> absolute values at offset zero, in the group's unit
    """
    widths = {}
    for name, centre in centres.items():
        group, width = BY_NAME[name], settings.width(name)
        widths[group.name] = (
            width * np.abs(centre) if group.relative else np.full_like(centre, width)
        )
    return widths
