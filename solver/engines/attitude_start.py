"""A start for fits whose estimated pointings, position angles or detectors' turns are far off.

The steps of Gauss-Newton find the mode from pointings that are arcminutes off and from position
angles up to some 90 deg off. Two programs that define a sign or a zero point in different ways
differ by more. Each measurement names its source, so that the attitude of an exposure follows in
closed form: it is the rotation that best aligns the directions in which the measured pixels look
with the directions to their sources (Wahba 1965, by the singular value decomposition of Markley
1988).
"""

import numpy as np
from jaxtyping import Float

from solver.data.parameters import BY_NAME
from solver.engines.detector_axes import DetectorAxes, detector_axes
from solver.errors import InputError
from solver.model.astrometry import sky_position
from solver.model.directions import displaced, tangent_frame
from solver.problem.problem import Problem
from solver.units import RAD_PER_ARCSEC, RAD_PER_MAS

# Chi2 per coordinate above which the attitudes are suspected: residuals of a thousand sigmas.
# Below, nothing is computed.
_SUSPICIOUS = 1e6
# Weight of the attitude at the start relative to a measurement. It decides what the measurements
# leave open, such as the position angle of an exposure of a single source.
_WEIGHT_OF_START = 1e-12
# Smallest cosine of the angle between two pointings that their tangent plane can express well.
_NEAREST_TO_HORIZON = 0.1
# Correlation of the detectors' places with those of the instrument below which some are exchanged.
_LEAST_AGREEMENT = 0.9
# Smallest turn of a detector that is not left to the fit, and most widths of its prior, arcsec.
_LARGE_TURN, _MOST_WIDTHS = 30.0 * 3600.0, 5.0
_TURN = 2.0 * np.pi
_ATTITUDE = ("pointing_ra", "pointing_dec", "position_angle")


def attitude_start(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    chi2: float,
) -> Float[np.ndarray, " calib"]:
    """Return the calibration with the attitude of each exposure that its measurements imply.

    Aberration and distortion are neglected, and the focal length and the detectors are those of
    `theta`. Their errors of up to a minute of arc are small enough for Gauss-Newton.

    Parameters
    ----------
    chi2 : of the data at `theta` and `sources`

    Returns
    -------
    `theta` itself unless its residuals are very large

    Raises
    ------
    InputError
        If these are, and the pixel axes of a detector are mirrored, or turned by an angle that
        the prior of its rotation does not allow, or detectors are exchanged.
    """
    if not chi2 > _SUSPICIOUS * 2 * problem.n_obs:
        return theta
    axes = _axes(problem, theta)
    exposure, frame = problem.measurements.index.exposure, problem.geometry.source_frame
    seen = displaced(frame[: problem.n_src], *(RAD_PER_MAS * sources).T)
    seen = seen[problem.measurements.index.source]
    # By the instrument: a start from something else may have anything.
    nominal = _looking(problem, np.zeros_like(theta))
    theta = _with_turned_detectors(problem, theta, detector_axes(problem, nominal, seen))
    looking = _looking(problem, theta)
    aligned = np.zeros_like(axes)
    for i, j in np.ndindex(3, 3):
        products = looking[:, i] * seen[:, j]
        aligned[:, i, j] = np.bincount(exposure, products, minlength=len(axes))
    left, _, right = np.linalg.svd(aligned + _WEIGHT_OF_START * axes)
    # The focal plane is seen from behind: its axes are left-handed.
    left[:, :, 2] *= -(np.linalg.det(left) * np.linalg.det(right))[:, None]
    return _with_axes(problem, theta, left @ right)


def _values(
    problem: Problem, theta: Float[np.ndarray, " calib"]
) -> dict[str, Float[np.ndarray, " _"]]:
    """Return origin plus offset of each group, in its unit; of the pointing the offset alone."""
    offsets = problem.layout.scatter(theta)
    origin = problem.geometry.origin
    return {
        name: values + origin[name][: len(values)] if name in origin else values
        for name, values in offsets.items()
    }


def _axes(problem: Problem, theta: Float[np.ndarray, " calib"]) -> Float[np.ndarray, "exp 3 3"]:
    """Return the axes of the focal plane of each exposure, as `projection.focal_axes`."""
    values = _values(problem, theta)
    offset = [RAD_PER_ARCSEC * values[f"pointing_{axis}"] for axis in ("ra", "dec")]
    centre = displaced(problem.geometry.pointing_frame[: len(offset[0])], *offset)
    _, east, north = tangent_frame(*sky_position(centre)).swapaxes(0, 1)
    angle = RAD_PER_ARCSEC * values["position_angle"][:, None]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([-c * east + s * north, s * east + c * north, centre], axis=1)


def _looking(problem: Problem, theta: Float[np.ndarray, " calib"]) -> Float[np.ndarray, "obs 3"]:
    """Return the direction of each measured pixel along the axes of its exposure."""
    values, index = _values(problem, theta), problem.measurements.index
    n = index.detector
    angle = RAD_PER_ARCSEC * values["detector_rotation"][n]
    along, across = (
        values[f"pitch_{axis}"][n] * problem.measurements.measured[:, column]
        for column, axis in enumerate("xy")
    )
    c, s = np.cos(angle), np.sin(angle)
    x = values["detector_x"][n] + c * along + s * across
    y = values["detector_y"][n] - s * along + c * across
    looking = np.stack([x, y, values["focal_length"][index.exposure]], axis=-1)
    return looking / np.linalg.norm(looking, axis=-1, keepdims=True)


def _with_turned_detectors(
    problem: Problem, theta: Float[np.ndarray, " calib"], found: DetectorAxes
) -> Float[np.ndarray, " calib"]:
    """Return the calibration with the detectors turned that are far from their rotation."""
    turns = found.turn
    columns = problem.layout.columns(BY_NAME["detector_rotation"])
    turned = abs(turns) > _LARGE_TURN * RAD_PER_ARCSEC
    moved = theta.copy()
    moved[columns] = np.where(turned, turns / RAD_PER_ARCSEC, theta[columns])
    refused = turned & (abs(moved[columns]) > _MOST_WIDTHS * problem.priors.width[columns])
    if refused.any():
        called = [problem.elements["det"][number].name for number in np.flatnonzero(refused)]
        angles = ", ".join(f"{angle:.0f}" for angle in np.degrees(turns[refused]))
        raise InputError(
            "columns nx, ny, detector_id of the measurements: expected detectors turned as in the "
            f"instrument, found detector {', '.join(called)} turned by about {angles} deg against "
            "it: check the ids, the signs of nx and ny and rotation_deg of the instrument, or "
            "widen the prior, such as --prior detector_rotation=180deg"
        )
    if found.agreement < _LEAST_AGREEMENT and _are_places_known(problem):
        raise InputError(
            "column detector_id of the measurements: expected detectors where the instrument has "
            f"them, found the sky elsewhere on them (correlation {found.agreement:.2f}, expected "
            "1): check the ids, and x_um and y_um of the instrument"
        )
    return moved


def _are_places_known(problem: Problem) -> bool:
    """Return whether the priors of the detectors' places tell the detectors apart."""
    values = _values(problem, np.zeros(problem.layout.size))
    names = ("detector_x", "detector_y")
    columns = np.concatenate([problem.layout.columns(BY_NAME[name]) for name in names])
    apart = np.linalg.norm([values[name].std() for name in names])
    return bool(_MOST_WIDTHS * problem.priors.width[columns].min() < apart)


def _with_axes(
    problem: Problem, theta: Float[np.ndarray, " calib"], axes: Float[np.ndarray, "exp 3 3"]
) -> Float[np.ndarray, " calib"]:
    """Return the calibration with the attitude of each exposure that its tangent plane holds."""
    origin = problem.geometry.pointing_frame[: len(axes)]
    along = np.einsum("nij,nj->ni", origin, axes[:, 2])
    chosen = along[:, 0] > _NEAREST_TO_HORIZON
    _, east, north = tangent_frame(*sky_position(axes[:, 2])).swapaxes(0, 1)
    sine, cosine = (np.einsum("nj,nj->n", axes[:, 0], axis) for axis in (north, -east))
    angle = np.arctan2(sine, cosine)
    before = RAD_PER_ARCSEC * _values(problem, theta)["position_angle"]
    turned = np.remainder(angle - before + 0.5 * _TURN, _TURN) - 0.5 * _TURN
    moved = theta.copy()
    columns = {name: problem.layout.columns(BY_NAME[name])[chosen] for name in _ATTITUDE}
    moved[columns["pointing_ra"]] = (along[:, 1] / along[:, 0])[chosen] / RAD_PER_ARCSEC
    moved[columns["pointing_dec"]] = (along[:, 2] / along[:, 0])[chosen] / RAD_PER_ARCSEC
    moved[columns["position_angle"]] += turned[chosen] / RAD_PER_ARCSEC
    return moved
