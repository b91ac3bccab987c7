"""How the pixel axes of the detectors lie on the sky: mirrored, or turned against the instrument.

The fit takes small steps, and can undo neither. In complex numbers the focal plane shows the sky
around a pointing as z = exp(-i theta) w, Eq. (method:ideal), with z = x + i y and w = -E + i N,
E to the east and N to the north. Mirrored axes go with the conjugate of w instead.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from solver.errors import InputError
from solver.model.astrometry import sky_position
from solver.model.directions import tangent_frame
from solver.problem.problem import Problem

# Stars of one exposure on one detector from which the directions of its axes are clear.
_FEWEST = 5
# How much better the conjugate has to correlate than w does, of 1.
_CLEAR = 0.5
# Share of the exposures' angles that has to agree, and correlation from which the stars are those
# of the catalogue: with wrong identifications, nothing can be said of the detectors.
_COHERENT, _SURE = 0.5, 0.9


class _Groups(NamedTuple):
    """The group of each measurement: those of an exposure, or of a detector in an exposure."""

    number: Int[np.ndarray, " obs"]
    count: int

    def sums(self, values: Complex[np.ndarray, " obs"]) -> Complex[np.ndarray, " group"]:
        """Return the sums over each group."""
        real, imaginary = (
            np.bincount(self.number, part, self.count)
            for part in (np.real(values), np.imag(values))
        )
        return real + 1j * imaginary

    def correlation(
        self, first: Complex[np.ndarray, " obs"], second: Complex[np.ndarray, " obs"]
    ) -> Complex[np.ndarray, " group"]:
        """Return the correlation over each group, of size 1 where one is the other, turned."""
        squares = [np.real(self.sums(one * one.conj())) for one in (first, second)]
        scale = np.sqrt(np.maximum(np.prod(squares, axis=0), np.finfo(float).tiny))
        return self.sums(first * second.conj()) / scale

    def centred(self, values: Complex[np.ndarray, " obs"]) -> Complex[np.ndarray, " obs"]:
        """Return the differences to the mean of each group."""
        many = np.bincount(self.number, minlength=self.count)
        return values - (self.sums(values) / np.maximum(many, 1))[self.number]


class DetectorAxes(NamedTuple):
    """How the detectors lie on the sky, against the instrument.

    Attributes
    ----------
    turn : of each detector, rad, counted from the angle at which their places lie; 0 where it is
        not known
    agreement : of their places with those of the instrument, 1 if they are as they should be up to
        a turn of all; NaN if it is not known
    """

    turn: Float[np.ndarray, " det"]
    agreement: float


def detector_axes(
    problem: Problem, looking: Float[np.ndarray, "obs 3"], seen: Float[np.ndarray, "obs 3"]
) -> DetectorAxes:
    """Return how the detectors lie on the sky.

    Parameters
    ----------
    looking : directions of the measured pixels along the axes of their exposure, by the instrument
    seen : directions to their sources; any error of the pointings is harmless

    Raises
    ------
    InputError
        If a detector shows the sky mirrored.
    """
    index, n_det = problem.measurements.index, problem.measurements.n_det
    n_exp = problem.layout.n_exp
    exposures = _Groups(index.exposure, n_exp)
    groups = _Groups(index.exposure * n_det + index.detector, n_exp * n_det)
    z = exposures.centred(looking[:, 0] + 1j * looking[:, 1])
    w = exposures.centred(_on_the_sky(exposures, seen))
    z_here, w_here = groups.centred(z), groups.centred(w)
    many = np.bincount(groups.number, minlength=groups.count) >= _FEWEST
    along, mirrored = (
        np.where(many, one, np.nan).reshape(n_exp, n_det)
        for one in (groups.correlation(z_here, w_here), groups.correlation(z_here, w_here.conj()))
    )
    _require_handedness(problem, abs(along) ** 2 - abs(mirrored) ** 2)
    of_places = exposures.correlation(z - z_here, w - w_here)
    several = (~np.isnan(along)).sum(axis=1) > 1
    if not several.any():
        return DetectorAxes(np.zeros(n_det), np.nan)
    angle = along[several] * of_places[several, None].conj()
    total, possible = np.nansum(angle, axis=0), np.nansum(abs(angle), axis=0)
    is_known = abs(total) > _COHERENT * np.maximum(possible, np.finfo(float).tiny)
    are_stars = np.nanmedian(abs(along)) > _SURE
    agreement = float(np.median(abs(of_places[several]))) if are_stars else np.nan
    return DetectorAxes(np.where(is_known & are_stars, np.angle(total), 0.0), agreement)


def _on_the_sky(
    exposures: _Groups, seen: Float[np.ndarray, "obs 3"]
) -> Complex[np.ndarray, " obs"]:
    """Return -E + i N of directions, relative to the mean direction of their exposure."""
    centre = np.stack([np.real(exposures.sums(one + 0j)) for one in seen.T], axis=-1)
    frame = tangent_frame(*sky_position(centre))[exposures.number]
    east, north = (np.einsum("oj,oj->o", frame[:, axis], seen) for axis in (1, 2))
    return -east + 1j * north


def _require_handedness(problem: Problem, handedness: Float[np.ndarray, "exp det"]) -> None:
    mirrored = [
        element.name
        for element, values in zip(problem.elements["det"], handedness.T, strict=True)
        if np.isfinite(values).any() and np.nanmedian(values) < -_CLEAR
    ]
    if mirrored:
        raise InputError(
            "columns nx, ny of the measurements: expected pixel axes with the handedness of "
            f"Eq. (exp:model:nxny), found the sky mirrored on detector {', '.join(mirrored)}: "
            "exchange nx and ny there, or change the sign of one of them"
        )
