"""Columns of the causes that a fit includes: what its optional parameters can take up.

A fit with a cause leaves less of the residuals to the tests: the expected values are exact only if
the parameters of the cause are among those that `solver.results.diagnosis.projection` eliminates.
A group that is not known here counts as not fitted, so that the tests find less, never more.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg

from solver.data.distortion_terms import terms
from solver.data.magnitudes import faintness
from solver.data.result import FitResult
from solver.problem.walks import MEAN_WIDTH_UM
from solver.results.diagnosis.rows import Camera, Rows, onto_focal_plane
from solver.units import PIX_PER_MPIX, RAD_PER_ARCSEC


class Scalar(NamedTuple):
    """A displacement along x by one parameter, and the same along y by another.

    Attributes
    ----------
    value : of each row, um, shape (n,), per unit of the sigmas
    sigma_x, sigma_y : widths of the priors
    """

    value: np.ndarray
    sigma_x: float
    sigma_y: float


class Vector(NamedTuple):
    """A displacement along both axes of the focal plane by one parameter.

    Attributes
    ----------
    x, y : of each row, um, shape (n,), per unit of `sigma`
    sigma : width of the prior
    """

    x: np.ndarray
    y: np.ndarray
    sigma: float


Column = Scalar | Vector


def has_anisotropy(result: FitResult) -> bool:
    """Return whether each exposure has a focal length for each axis."""
    return "focal_anisotropy" in result.group_rows


def prior_widths(result: FitResult) -> dict[str, np.ndarray]:
    """Return the widths of the priors of each group of parameters, by its name."""
    sigma = result.calibration["prior_sigma"].to_numpy()
    return {name: sigma[rows] for name, rows in result.group_rows.items()}


def modelled(
    result: FitResult, camera: Camera, rows: Rows, widths: dict[str, np.ndarray]
) -> Iterator[Column]:
    """Yield the columns of the causes that a fit includes, but for those of each exposure.

    Parameters
    ----------
    widths : of the priors
    """
    yield from _of_terms(result, camera, rows, widths)
    yield from _of_detectors(result, camera, rows, widths)
    yield from _of_motion(camera, rows, widths)


def walk_terms(result: FitResult, rows: Rows) -> list[np.ndarray]:
    """Return the terms of the distortion that change from exposure to exposure as random walks."""
    degree = min(result.settings.drift_walk, int(result.summary["order"]))
    if not terms(degree):
        return []
    x, y = (legendre.legvander(along, max(degree, 1)).T for along in rows.at.T)
    return [x[k] * y[j] for k, j in terms(degree)]


def walk_precision(result: FitResult, exposures: np.ndarray) -> np.ndarray:
    """Return the precision of the prior of walks along x and along y at some of the exposures.

    The steps from each exposure to the next one in time are independent, and the mean is of
    little width: it belongs to the constant distortion. Shape (2, exposures, exposures).
    """
    place = np.argsort(np.argsort(result.exposures["obstime"].to_numpy(), kind="stable"))
    steps = np.minimum.outer(place, place).astype(float)
    steps -= steps.mean(axis=0) + steps.mean(axis=1)[:, None] - steps.mean()
    some = steps[np.ix_(exposures, exposures)]
    widths = [result.settings.width(f"drift_walk_{axis}") for axis in "xy"]
    # The width may be infinite.
    return np.array([linalg.pinvh(some + (MEAN_WIDTH_UM / one) ** 2) / one**2 for one in widths])


def _of_terms(
    result: FitResult, camera: Camera, rows: Rows, widths: dict[str, np.ndarray]
) -> Iterator[Column]:
    """Yield the columns of terms of the distortion that drift, breathe, or are of a part."""
    settings = result.settings
    families = (
        ("drift", settings.drift, _powers_of_time),
        ("breathing", settings.breathing, _orbital_waves),
        ("field_distortion", settings.field_distortion, _later_fields),
        ("own_distortion", settings.detector_distortion, _each_detector),
    )
    for name, order, factors_of in families:
        if f"{name}_x" not in widths:
            continue
        factors, of_order = factors_of(result, camera, rows), terms(order)
        sigmas = widths[f"{name}_x"], widths[f"{name}_y"]
        if len(sigmas[0]) != len(factors) * len(of_order):
            continue
        place = _on_detector(camera, rows) if name == "own_distortion" else rows.at
        in_x, in_y = (legendre.legvander(along, order).T for along in place.T)
        values = (factor * in_x[k] * in_y[j] for factor in factors for k, j in of_order)
        for number, value in enumerate(values):
            yield Scalar(value, sigmas[0][number], sigmas[1][number])


def _powers_of_time(result: FitResult, camera: Camera, rows: Rows) -> np.ndarray:
    in_time = legendre.legvander(2.0 * camera.time, result.settings.drift_in_time)
    return in_time[:, 1:].T[:, rows.exposure]


def _orbital_waves(result: FitResult, camera: Camera, rows: Rows) -> np.ndarray:
    del result
    return np.array([np.cos(camera.phase), np.sin(camera.phase)])[:, rows.exposure]


def _later_fields(result: FitResult, camera: Camera, rows: Rows) -> np.ndarray:
    del camera
    field = np.unique(result.exposures["field_id"].to_numpy(), return_inverse=True)[1]
    later = np.arange(1, field.max() + 1)
    return (field[rows.exposure] == later[:, None]).astype(float)


def _each_detector(result: FitResult, camera: Camera, rows: Rows) -> np.ndarray:
    del result
    return (rows.detector == np.arange(len(camera.turn))[:, None]).astype(float)


def _on_detector(camera: Camera, rows: Rows) -> np.ndarray:
    """Return the place on its detector of each row, over half the size of the detector."""
    half = (camera.half * camera.pitch).max(axis=1)
    own = camera.scale * rows.at - camera.centre[rows.detector]
    return own / half[rows.detector, None]


def _of_detectors(
    result: FitResult, camera: Camera, rows: Rows, widths: dict[str, np.ndarray]
) -> Iterator[Column]:
    """Yield the columns of the groups with one parameter of each detector."""
    none = np.zeros(rows.n)
    # Displacement along each axis, pixels, by its own coordinate.
    along: dict[str, Callable[[int], np.ndarray]] = {
        "magnitude_shift": lambda _: PIX_PER_MPIX * _faintness(result)[rows.source],
        "charge_transfer": lambda axis: (
            PIX_PER_MPIX * _faintness(result)[rows.source] * (0.5 * rows.local[:, axis] + 0.5)
        ),
        "phase_sine": lambda axis: PIX_PER_MPIX * np.sin(2.0 * np.pi * rows.pixel[:, axis]),
        "phase_cosine": lambda axis: PIX_PER_MPIX * np.cos(2.0 * np.pi * rows.pixel[:, axis]),
    }
    shifts: dict[str, tuple[Callable[[int], np.ndarray], int]] = {
        "detector_skew": (lambda _: RAD_PER_ARCSEC * rows.pixel[:, 1], 0)
    }
    for axis, direction in enumerate("xy"):
        shifts |= {f"{name}_{direction}": (of_axis, axis) for name, of_axis in along.items()}
    for name, (of_axis, axis) in shifts.items():
        if name not in widths:
            continue
        value = of_axis(axis)
        pixels = np.stack([value, none] if axis == 0 else [none, value], axis=1)
        x, y = onto_focal_plane(pixels * camera.pitch[rows.detector], camera.turn, rows.detector).T
        for detector, sigma in enumerate(widths[name]):
            on = rows.detector == detector
            yield Vector(x * on, y * on, sigma)


def _of_motion(camera: Camera, rows: Rows, widths: dict[str, np.ndarray]) -> Iterator[Column]:
    """Yield the columns of detectors that move and turn from span to span."""
    if "detector_turn" not in widths:
        return
    of_row = camera.span[rows.exposure]
    pixel = RAD_PER_ARCSEC * rows.pixel * camera.pitch[rows.detector]
    turned = np.stack([-pixel[:, 1], pixel[:, 0]], axis=1)
    x, y = onto_focal_plane(turned, camera.turn, rows.detector).T
    later = max(int(camera.span.max()), 1)
    for element in range(len(camera.turn) * later):
        moved = (rows.detector == element // later) & (of_row == element % later + 1)
        on = moved.astype(float)
        sigmas = (widths[f"detector_motion_{axis}"][element] for axis in "xy")
        yield Scalar(on, *sigmas)
        yield Vector(x * on, y * on, widths["detector_turn"][element])


def _faintness(result: FitResult) -> np.ndarray:
    """Return flux^(-1/2) of the sources, zero without a magnitude."""
    if "magnitude" not in result.sources:
        return np.zeros(len(result.sources))
    return faintness(result.sources["magnitude"].to_numpy(dtype=float))


def _has_found_noise(result: FitResult) -> bool:
    """Return whether the search for the noise that fits has come to an end."""
    noise = result.summary.get("noise")
    return noise is not None and bool(noise["converged"])


# What a fit adjusts until a test of the size of the residuals finds nothing.
_ADJUSTED: dict[str, Callable[[FitResult], bool]] = {
    "noise": lambda result: (
        (
            result.settings.noise_scale
            or result.settings.noise_by_exposure
            or result.settings.noise_by_magnitude
        )
        and _has_found_noise(result)
    ),
    "exposures": lambda result: result.settings.noise_by_exposure and _has_found_noise(result),
    "magnitudes": lambda result: result.settings.noise_by_magnitude and _has_found_noise(result),
    "stretch": has_anisotropy,
}


def is_adjusted(result: FitResult, subject: str) -> bool:
    """Return whether the fit adjusts what a test is about, which then says nothing."""
    return subject in _ADJUSTED and _ADJUSTED[subject](result)
