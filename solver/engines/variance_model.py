"""Variances of the measurements as a function of few parameters, and a scoring step of these.

The variance of a measurement is its stated variance times the exponential of a linear predictor,
plus the square of a floor that all measurements share.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from solver.errors import InputError
from solver.linear.leverage import Residuals

# Largest step of the logarithm of a variance.
_MAX_STEP = 3.0
# Information about a combination of parameters, relative to that about each alone, below which
# the measurements do not tell them apart.
_INDISTINCT = 1e-6


class VarianceModel(NamedTuple):
    """The model of an orbit's measurements.

    Its parameters are the coefficients of the predictors, and last, if there is a floor, the square
    of the floor over the mean stated variance.

    Attributes
    ----------
    names : of the predictors
    design : value of each predictor at each measurement
    stated : stated uncertainties, pixel
    has_floor : whether there is a floor
    """

    names: list[str]
    design: Float[np.ndarray, "obs predictor"]
    stated: Float[np.ndarray, "obs 2"]
    has_floor: bool

    def of_rows(self, rows: Int[np.ndarray, " row"]) -> tuple["VarianceModel", "VarianceModel"]:
        """Return this model and that of some measurements, without predictors of none of these."""
        of_some = self.design[rows]
        kept = np.any(of_some != 0.0, axis=0) | ~np.any(self.design != 0.0, axis=0)
        names = [name for name, is_kept in zip(self.names, kept.tolist(), strict=True) if is_kept]
        whole = self._replace(names=names, design=self.design[:, kept])
        return whole, whole._replace(design=of_some[:, kept], stated=self.stated[rows])

    def start(self) -> Float[np.ndarray, " parameter"]:
        """Return the parameters of the stated variances."""
        return np.zeros(len(self.names) + self.has_floor)

    def factor(self, at: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, " obs"]:
        """Return the factor on each stated uncertainty."""
        return np.exp(0.5 * self.design @ at[: len(self.names)])

    def floor(self, at: Float[np.ndarray, " parameter"]) -> float:
        """Return the floor, pixel."""
        return float(np.sqrt(at[-1] * self._unit())) if self.has_floor else 0.0

    def sigma(self, at: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, "obs 2"]:
        """Return the uncertainties of the measurements, pixel."""
        return np.hypot(self.stated * self.factor(at)[:, None], self.floor(at))

    def floor_sigma(
        self, at: Float[np.ndarray, " parameter"], sigma: Float[np.ndarray, " parameter"]
    ) -> float:
        """Return the uncertainty of the floor, pixel.

        The estimate of its square has a normal error. That of a floor below its uncertainty is the
        root of the uncertainty of the square.
        """
        of_square = sigma[-1] * self._unit()
        floor = max(self.floor(at), float(np.sqrt(0.25 * of_square)))
        return float(0.5 * of_square / floor)

    def step(
        self, at: Float[np.ndarray, " parameter"], found: Residuals
    ) -> tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, " parameter"]]:
        """Return a scoring step of the parameters, and their uncertainties.

        Parameters
        ----------
        found : residuals of the fit with these parameters

        Raises
        ------
        InputError
            If the measurements do not tell the parameters apart.
        """
        squares, expected = (found.whitened**2).sum(axis=1), 2.0 - found.trace
        columns = self._derivatives(at)
        information = columns.T @ (expected[:, None] * columns)
        self._check_distinct(information)
        right = columns.T @ (squares - expected)
        raw = np.linalg.solve(information, right)
        if self.has_floor and at[-1] == 0.0 and raw[-1] < 0.0:
            # The square of the floor stays at its bound, and the others move without it.
            raw = np.append(np.linalg.solve(information[:-1, :-1], right[:-1]), 0.0)
        count = len(self.names)
        # For a factor alone, the raw step is the ratio of the variances minus one.
        bounded = np.clip(raw[:count], np.expm1(-_MAX_STEP), np.expm1(_MAX_STEP))
        moved = np.append(np.log1p(bounded), np.maximum(raw[count:], -at[count:]))
        # Powers of the magnitude make much of a small step, where stars are far from the mean.
        furthest = float(np.abs(self.design @ moved[:count]).max(initial=0.0))
        moved *= min(1.0, _MAX_STEP / max(furthest, _MAX_STEP))
        return moved, np.sqrt(2.0 * np.diag(np.linalg.inv(information)))

    def _check_distinct(self, information: Float[np.ndarray, "n n"]) -> None:
        scale = np.sqrt(np.diag(information))
        if scale.all() and not (
            len(scale) and np.linalg.eigvalsh(information / np.outer(scale, scale))[0] < _INDISTINCT
        ):
            return
        if self.has_floor:
            raise InputError(
                "noise floor: expected stated uncertainties that differ between measurements, "
                "found the same for all, for which a floor does what a factor does; leave one of "
                "them out"
            )
        raise InputError(
            "noise by magnitude: expected stars of different magnitudes, found the same for all"
        )

    def _unit(self) -> float:
        return float(np.mean(self.stated**2))

    def _derivatives(
        self, at: Float[np.ndarray, " parameter"]
    ) -> Float[np.ndarray, "obs parameter"]:
        """Return the derivatives of the logarithm of the variance, mean of both coordinates."""
        variance = self.sigma(at) ** 2
        scaled = (self.stated * self.factor(at)[:, None]) ** 2
        columns = (scaled / variance).mean(axis=1)[:, None] * self.design
        if not self.has_floor:
            return columns
        of_floor = (self._unit() / variance).mean(axis=1)
        return np.column_stack([columns, of_floor])
