"""Priors of the calibration parameters and the sources, in offsets from their origins.

Paper, table "Inputs, Model Parameters, and Priors", and Eq. (exp:priors). The centre of
every prior is the parameter's origin, so that its offset is zero there. The default widths are in
the table of parameter groups, `solver.data.parameters`.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.data.parameters import BY_NAME, SOURCES
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.problem.parameter_vector import VectorLayout
from solver.problem.walks import NO_WALKS, Walks

# Widths in the centre of a gamma prior. With fewer, its mode is more than a ninth below the centre,
# and with one or less it has none.
_LEAST_CENTRE = 3


class Priors(NamedTuple):
    """Independent priors of the calibration parameters, and a Gaussian prior per source.

    Of distortion coefficients that walk, mean and steps are independent: see `Walks.independent`.

    `centre` is the absolute value at offset zero, used by gamma priors; `width` the standard
    deviation, `inf` where flat; `precision` the inverse covariance of (alpha*, delta),
    mas^-2.
    """

    centre: Float[np.ndarray, " calib"]
    width: Float[np.ndarray, " calib"]
    is_gamma: Bool[np.ndarray, " calib"]
    precision: Float[np.ndarray, "src 2 2"]
    walks: Walks = NO_WALKS

    def penalty(
        self, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
    ) -> float:
        """Return minus twice the logarithm of the prior density, zero at the centres."""
        independent = self.walks.independent(theta)
        normal = np.where(self.is_gamma, 0.0, (independent / self.width) ** 2)
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
        slope = self.walks.transposed(self.walks.independent(theta) / self.width**2)
        shape, value = self._gamma(theta)
        slope[self.is_gamma] = 1.0 / self._gamma_scale() - (shape - 1.0) / value
        return slope

    def source_gradient(self, sources: Float[np.ndarray, "src 2"]) -> Float[np.ndarray, "src 2"]:
        """Return the derivative of half the penalty with respect to the sources."""
        return np.einsum("sij,sj->si", self.precision, sources)

    def hessian_diagonal(self, theta: Float[np.ndarray, " calib"]) -> Float[np.ndarray, " calib"]:
        """Return the second derivatives of half the penalty by the independent values."""
        prior_hessian = self.width**-2.0
        shape, value = self._gamma(theta)
        prior_hessian[self.is_gamma] = (shape - 1.0) / value**2
        return prior_hessian

    def with_hessian(
        self, matrix: Float[np.ndarray, "calib calib"], theta: Float[np.ndarray, " calib"]
    ) -> Float[np.ndarray, "calib calib"]:
        """Return a matrix plus the second derivatives of half the penalty by the calibration."""
        total, added = matrix.copy(), self.hessian_diagonal(theta)
        of_walks = self.walks.hessian(added)
        added[self.walks.columns] = 0.0
        total[np.diag_indices(len(added))] += added
        for columns, of_walk in zip(self.walks.columns, of_walks, strict=True):
            total[np.ix_(columns, columns)] += of_walk
        return total

    def scaled(
        self, vectors: Float[np.ndarray, "calib k"], theta: Float[np.ndarray, " calib"]
    ) -> Float[np.ndarray, "calib k"]:
        """Return vectors in units of the priors' widths, of their independent values."""
        return self.walks.independent(vectors) * np.sqrt(self.hessian_diagonal(theta))[:, None]

    def shares(
        self,
        theta: Float[np.ndarray, " calib"],
        variance: Float[np.ndarray, " calib"],
        covariance: Float[np.ndarray, "calib calib"],
    ) -> Float[np.ndarray, " calib"]:
        """Return the share of its prior in each parameter; the sum is that of all parameters.

        Parameters
        ----------
        variance, covariance : of the posterior; the covariance is used for walks only
        """
        diagonal = self.hessian_diagonal(theta)
        found = diagonal * variance
        for columns, of_walk in zip(self.walks.columns, self.walks.hessian(diagonal), strict=True):
            found[columns] = np.einsum("ij,ji->i", of_walk, covariance[np.ix_(columns, columns)])
        return found

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


def priors_of(
    covariance: Float[np.ndarray, "src 2 2"],
    centres: dict[str, Float[np.ndarray, " _"]],
    settings: FitSettings,
    layout: VectorLayout,
    walks: Walks,
) -> Priors:
    """Return the priors of a problem.

    Parameters
    ----------
    covariance : of the catalogue's (alpha*, delta) of each source, mas^2
    centres : group name -> absolute values at offset zero, in the group's unit

    Raises
    ------
    InputError
        If a gamma prior is so wide that its mode is far from its centre.
    """
    widths = group_widths(settings, centres)
    _require_narrow(widths, centres)
    # A flat prior has no shape.
    is_gamma = {
        name: np.isfinite(width) & (BY_NAME[name].family == "gamma")
        for name, width in widths.items()
    }
    return Priors(
        centre=layout.gather(centres),
        width=walks.with_widths_of_means(layout.gather(widths)),
        is_gamma=layout.gather(is_gamma).astype(bool),
        precision=np.linalg.inv(covariance * settings.width(SOURCES.name) ** 2),
        walks=walks,
    )


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


def _require_narrow(
    widths: dict[str, Float[np.ndarray, " _"]], centres: dict[str, Float[np.ndarray, " _"]]
) -> None:
    for name, width in widths.items():
        if BY_NAME[name].family != "gamma" or not np.isfinite(width).all():
            continue
        widest = float(np.min(np.abs(centres[name]), initial=np.inf)) / _LEAST_CENTRE
        if (width > widest).any():
            raise InputError(
                f"prior of {name}: expected a width of {widest:.6g} {BY_NAME[name].unit} or less, "
                f"which is one part in {_LEAST_CENTRE} of the smallest value, found "
                f"{width.max():.6g}; check the values' unit; 'flat' lets them be anything"
            )
