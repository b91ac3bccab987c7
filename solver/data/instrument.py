"""Instrument: the nominal focal plane, either that of the mini-mock or read from TOML.

Paper, section "Survey Design": focal length, four detectors of 1920 x 1920 pixels of
10 um in a 2 x 2 grid with gaps of 3 mm. A detector's rotation is that of the model,
Eq. (exp:model:nxny), which is minus the angle at which the detector is mounted.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from solver.data.toml import parse_toml
from solver.errors import InputError


@dataclass(frozen=True)
class Detector:
    """Nominal position, rotation and pixels of one detector.

    Attributes
    ----------
    detector_id : as in the measurement table
    x_um, y_um : centre on the focal plane, um
    rotation_deg : rotation of Eq. (exp:model:nxny), deg
    pitch_x_um, pitch_y_um : pixel pitch, um
    n_x, n_y : number of pixels
    """

    detector_id: int
    x_um: float
    y_um: float
    rotation_deg: float
    pitch_x_um: float
    pitch_y_um: float
    n_x: int
    n_y: int

    def corners_um(self) -> np.ndarray:
        """Return the corners on the distorted focal plane, um, shape (4, 2), in order."""
        half = 0.5 * np.array([self.n_x * self.pitch_x_um, self.n_y * self.pitch_y_um])
        pixels = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        c, s = np.cos(np.radians(self.rotation_deg)), np.sin(np.radians(self.rotation_deg))
        return pixels @ np.array([(c, -s), (s, c)]) + (self.x_um, self.y_um)


@dataclass(frozen=True)
class Instrument:
    """Nominal focal length, distortion scale and detectors of one instrument.

    Attributes
    ----------
    name : name to show
    focal_length_um : nominal focal length, um
    distortion_scale_um : 1/s of Eq. (model:Lx), the focal-plane radius mapped to 1, um
    detectors : in the order of the detector axis
    """

    name: str
    focal_length_um: float
    distortion_scale_um: float
    detectors: tuple[Detector, ...]

    @property
    def detector_ids(self) -> list[int]:
        """The ids of the detectors, in their order."""
        return [detector.detector_id for detector in self.detectors]

    def index_of(self, detector_ids: np.ndarray) -> np.ndarray:
        """Return the index of each id along the detector axis.

        Raises
        ------
        InputError
            If an id is not that of a detector.
        """
        known = {d.detector_id: i for i, d in enumerate(self.detectors)}
        ids, inverse = np.unique(detector_ids, return_inverse=True)
        if unknown := [int(i) for i in ids if int(i) not in known]:
            raise InputError(
                f"column detector_id: expected detectors of the instrument {self.name!r} "
                f"({self.detector_ids}), found {unknown}"
            )
        return np.array([known[int(i)] for i in ids], dtype=np.int64)[inverse]


def _mini_mock() -> Instrument:
    # As in the published simulator; the centres are at x, y = +-11.1 mm from the optical axis.
    positions = ((-1, -1, 0.0), (1, -1, -90.0), (1, 1, 180.0), (-1, 1, 90.0))
    return Instrument(
        name="JASMINE mini-mock",
        focal_length_um=4.86e6,
        distortion_scale_um=21_000.0,
        detectors=tuple(
            Detector(i, 11_100.0 * x, 11_100.0 * y, rotation, 10.0, 10.0, 1920, 1920)
            for i, (x, y, rotation) in enumerate(positions)
        ),
    )


MINI_MOCK = _mini_mock()

_LARGEST_WHOLE = 2**53
_DETECTOR_KEYS = {
    "id": "detector_id",
    "x_um": "x_um",
    "y_um": "y_um",
    "rotation_deg": "rotation_deg",
    "pitch_x_um": "pitch_x_um",
    "pitch_y_um": "pitch_y_um",
    "n_x": "n_x",
    "n_y": "n_y",
}


def read_instrument(path: Path) -> Instrument:
    """Read an instrument from a TOML file with the attributes of `Instrument`.

    `[[detector]]` tables hold `id`, `x_um`, `y_um`, `rotation_deg`, `pitch_x_um`,
    `pitch_y_um`, `n_x` and `n_y`.

    Raises
    ------
    InputError
        If the file cannot be read, a key is missing or unknown, or a value is invalid.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected an instrument in TOML, found: {error}") from error
    return parse_instrument(text, path)


def parse_instrument(text: str, path: Path | str) -> Instrument:
    """Return the instrument described by a TOML text.

    Parameters
    ----------
    text : content of the file, as for `read_instrument`
    path : the file, or where in it, for error messages

    Raises
    ------
    InputError
        As `read_instrument`.
    """
    content = parse_toml(text, path, "an instrument in TOML")
    tables = content.pop("detector", [])
    _expect_keys(path, "the file", content, {"name", "focal_length_um", "distortion_scale_um"})
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise InputError(f"{path}: expected at least one [[detector]] table, found none")
    if not isinstance(content["name"], str):
        raise InputError(f"{path}: expected name to be a text, found {content['name']!r}")
    detectors = tuple(_detector(path, number, table) for number, table in enumerate(tables))
    if len({d.detector_id for d in detectors}) < len(detectors):
        raise InputError(f"{path}: expected each detector id once, found one repeated")
    return Instrument(
        content["name"],
        _positive(path, "focal_length_um", content["focal_length_um"]),
        _positive(path, "distortion_scale_um", content["distortion_scale_um"]),
        detectors,
    )


def write_instrument(instrument: Instrument) -> str:
    """Return `instrument` as TOML text that `read_instrument` can read."""
    lines = [
        # A JSON string is also a TOML string.
        f"name = {json.dumps(instrument.name)}",
        f"focal_length_um = {instrument.focal_length_um!r}",
        f"distortion_scale_um = {instrument.distortion_scale_um!r}",
    ]
    for detector in instrument.detectors:
        lines += ["", "[[detector]]"]
        lines += [f"{key} = {getattr(detector, name)!r}" for key, name in _DETECTOR_KEYS.items()]
    return "\n".join(lines) + "\n"


def instrument_text(instrument: Instrument | None) -> str | None:
    """Return what `instrument_from` reads back: TOML text, or None if there is no instrument."""
    return None if instrument is None else write_instrument(instrument)


def instrument_from(text: object, path: Path | str) -> Instrument | None:
    """Return the instrument of what was stored, None if none was; errors as `parse_instrument`."""
    if text is None:
        return None
    if not isinstance(text, str):
        raise InputError(f"{path}: expected the text of an instrument, found {text!r}")
    return parse_instrument(text, path)


def _detector(path: Path | str, number: int, table: dict) -> Detector:
    where = f"detector number {number}"
    _expect_keys(path, where, table, set(_DETECTOR_KEYS))
    for key in ("pitch_x_um", "pitch_y_um", "n_x", "n_y"):
        _positive(path, f"{key} of {where}", table[key])
    values: dict[str, Any] = {}
    for key, name in _DETECTOR_KEYS.items():
        is_count = key in {"id", "n_x", "n_y"}
        if not _is_finite(table[key]) or (is_count and not isinstance(table[key], int)):
            kind = "a whole number" if is_count else "a number"
            raise InputError(
                f"{path}: expected {key} of {where} to be {kind}, found {table[key]!r}"
            )
        values[name] = table[key] if is_count else float(table[key])
    return Detector(**values)


def _expect_keys(path: Path | str, where: str, table: dict, expected: set[str]) -> None:
    missing, unknown = sorted(expected - set(table)), sorted(set(table) - expected)
    if missing or unknown:
        raise InputError(
            f"{path}: expected the keys {', '.join(sorted(expected))} in {where}; "
            f"missing: {', '.join(missing) or 'none'}; unknown: {', '.join(unknown) or 'none'}"
        )


def _positive(path: Path | str, name: str, value: object) -> float:
    if not isinstance(value, int | float) or not _is_finite(value) or not value > 0:
        raise InputError(f"{path}: expected {name} to be a positive number, found {value!r}")
    return float(value)


def _is_finite(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    # An integer may be too large to be a float.
    return math.isfinite(value) if isinstance(value, float) else abs(value) <= _LARGEST_WHOLE
