"""Columns of the causes that a fit includes: what its optional parameters can take up.

A fit with a cause leaves less of the residuals to the tests: the expected values are exact only if
the parameters of the cause are among those that `solver.results.diagnosis.projection` eliminates.
A group that is not known here counts as not fitted, so that the tests find less, never more.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd
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
    return bool((result.calibration["group"] == "focal_anisotropy").any())


def prior_widths(result: FitResult) -> dict[str, np.ndarray]:
    """Return the widths of the priors of each group of parameters, by its name."""
    group, names = pd.factorize(result.calibration["group"])
    sigma = result.calibration["prior_sigma"].to_numpy()
    return {name: sigma[group == number] for number, name in enumerate(names)}


def modelled(
    result: FitResult, camera: Camera, rows: Rows, widths: dict[str, np.ndarray]
) -> Iterator[Column]:
    """Yield the columns of the causes that a fit includes, but for those of each exposure.

    Parameters
    ----------
    widths : of the priors
    """
    yield from _of_terms(result, camera, rows, widths)
    yield from _of_detectors(camera, rows, widths, _faintness(result)[rows.source])
    yield from _of_motion(camera, rows, widths)


def walk_terms(result: FitResult, rows: Rows) -> list[np.ndarray]:
    """Return the terms of the distortion that change from exposure to exposure as random walks."""
    degree = min(result.settings.drift_walk, int(result.summary["order"]))
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
    settings, at = result.settings, camera.scale * rows.at
    field = np.unique(result.exposures["field_id"].to_numpy(), return_inverse=True)[1]
    later, detectors = np.arange(1, field.max() + 1), np.arange(len(camera.turn))
    in_time = legendre.legvander(2.0 * camera.time, settings.drift_in_time)[:, 1:].T
    own = at - camera.centre[rows.detector]
    half = (camera.half * camera.pitch).max(axis=1)[rows.detector, None]
    families = (
        ("drift", settings.drift, in_time[:, rows.exposure], rows.at),
        (
            "breathing",
            settings.breathing,
            np.array([np.cos(camera.phase), np.sin(camera.phase)])[:, rows.exposure],
            rows.at,
        ),
        (
            "field_distortion",
            settings.field_distortion,
            (field[rows.exposure] == later[:, None]).astype(float),
            rows.at,
        ),
        (
            "own_distortion",
            settings.detector_distortion,
            (rows.detector == detectors[:, None]).astype(float),
            own / half,
        ),
    )
    for name, order, factors, place in families:
        sigmas = widths.get(f"{name}_x", np.empty(0)), widths.get(f"{name}_y", np.empty(0))
        of_order = terms(order)
        if len(sigmas[0]) != len(factors) * len(of_order):
            continue
        in_x, in_y = (legendre.legvander(along, order).T for along in place.T)
        values = (factor * in_x[k] * in_y[j] for factor in factors for k, j in of_order)
        for number, value in enumerate(values):
            yield Scalar(value, sigmas[0][number], sigmas[1][number])


def _of_detectors(
    camera: Camera, rows: Rows, widths: dict[str, np.ndarray], fainter: np.ndarray
) -> Iterator[Column]:
    """Yield the columns of the groups with one parameter of each detector."""
    pixel = rows.pixel
    crossed = 0.5 * rows.local + 0.5
    angle, none = 2.0 * np.pi * pixel, np.zeros(rows.n)
    shift = PIX_PER_MPIX * fainter
    shifts: dict[str, tuple[np.ndarray, int]] = {"detector_skew": (RAD_PER_ARCSEC * pixel[:, 1], 0)}
    for axis, direction in enumerate("xy"):
        along = {
            "magnitude_shift": shift,
            "charge_transfer": shift * crossed[:, axis],
            "phase_sine": PIX_PER_MPIX * np.sin(angle[:, axis]),
            "phase_cosine": PIX_PER_MPIX * np.cos(angle[:, axis]),
        }
        shifts |= {f"{name}_{direction}": (value, axis) for name, value in along.items()}
    for name, (value, axis) in shifts.items():
        if name not in widths:
            continue
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
