"""The calibration of one orbit by groups of parameters that can be compared between orbits."""

from collections.abc import Iterable, Iterator

import numpy as np
import pandas as pd
from jaxtyping import Complex

from solver.data.distortion_terms import terms
from solver.data.run_schema import CALIBRATIONS

_PITCHES = ("pitch_x", "pitch_y")


def orbit_calibration(calibration: pd.DataFrame, orbit: int, epoch: float) -> pd.DataFrame:
    """Return `run_schema.CALIBRATIONS` of one orbit.

    What all detectors have in common is left out of their places, rotations and pitches: shift,
    turn and scale, which are the pointing, the roll and the focal length as well.

    Parameters
    ----------
    calibration : `schema.CALIBRATION` of the orbit
    orbit : orbit_id
    epoch : MJD in TCB
    """
    groups = dict(iter(calibration.groupby("group")))
    parts = [*_focal_length(groups), *_distortion(groups), *_detectors(groups)]
    # The angles may lie on both sides of zero.
    angle = np.radians(groups["position_angle"]["value"].to_numpy())
    mean = np.degrees(np.arctan2(np.sin(angle).mean(), np.cos(angle).mean())) % 360.0
    return pd.concat(parts, ignore_index=True).assign(
        orbit_id=orbit, epoch=epoch, position_angle=float(mean)
    )[CALIBRATIONS.names]


def _focal_length(groups: dict[str, pd.DataFrame]) -> Iterator[pd.DataFrame]:
    rows = groups["focal_length"]
    yield _rows("focal length", ["focal length"], [float(rows["value"].mean())], rows)


def _distortion(groups: dict[str, pd.DataFrame]) -> Iterator[pd.DataFrame]:
    if "distortion_x" not in groups:
        return
    x, y = groups["distortion_x"], groups["distortion_y"]
    degrees = np.array([sum(pair) for pair in terms(len(x) + 1)[: len(x)]])
    for degree in np.unique(degrees):
        both = pd.concat([x[degrees == degree], y[degrees == degree]])
        yield _rows(f"distortion, degree {degree}", both["label"], both["value"], both)


def _detectors(groups: dict[str, pd.DataFrame]) -> Iterator[pd.DataFrame]:
    x, y, rotation = (groups[f"detector_{name}"] for name in ("x", "y", "rotation"))
    if len(x) < 2:
        return
    places, nominal = (
        x[name].to_numpy() + 1j * y[name].to_numpy() for name in ("value", "prior_centre")
    )
    left = _without_common(places, nominal)
    labels = [*(f"{one}, x" for one in x["label"]), *(f"{one}, y" for one in y["label"])]
    if len(x) > 2:
        yield _rows("places of the detectors", labels, [*np.real(left), *np.imag(left)], x)
    turns = rotation["value"] - rotation["value"].mean()
    yield _rows("rotations of the detectors", rotation["label"], turns, rotation)
    pitches = pd.concat([groups[name] for name in _PITCHES])
    axes = np.repeat(["x", "y"], [len(groups[name]) for name in _PITCHES])
    labels = [f"{one}, {axis}" for one, axis in zip(pitches["label"], axes, strict=True)]
    values = pitches["value"] - pitches["value"].mean()
    yield _rows("pixel pitches of the detectors", labels, values, pitches)


def _without_common(
    places: Complex[np.ndarray, " det"], nominal: Complex[np.ndarray, " det"]
) -> Complex[np.ndarray, " det"]:
    """Return complex places less the shift, turn and scale that fit them best."""
    design = np.stack([np.ones(len(nominal)), nominal / np.abs(nominal).max()], axis=1)
    solved, *_ = np.linalg.lstsq(design, places, rcond=None)
    return places - design @ solved


def _rows(
    group: str, labels: Iterable[str], values: Iterable[float], rows: pd.DataFrame
) -> pd.DataFrame:
    columns = {"label": list(labels), "value": np.array(list(values), dtype=float)}
    return pd.DataFrame(columns).assign(group=group, unit=str(rows["value_unit"].iloc[0]))
