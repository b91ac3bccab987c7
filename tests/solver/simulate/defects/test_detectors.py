"""Defects of the detectors, compared with an orbit on a displaced detector, and by formula."""

from dataclasses import replace

import numpy as np
import pytest

from solver.data.instrument import MINI_MOCK
from solver.simulate.defects.defect import AppliedDefect
from solver.simulate.defects.detectors import motion
from tests.solver.simulate.defects.conftest import KEY, QUIET, on_focal_plane


@pytest.fixture
def moved(compare):
    """Return the function that gives the rows of the moved detector, after and before."""

    def split(text):
        rows = compare(text)
        is_moved = rows[["dx", "dy"]].abs().max(axis=1) > 1e-9
        part = rows[is_moved]
        assert part["detector_id"].nunique() == 1
        same = rows["detector_id"] == part["detector_id"].iloc[0]
        later = rows["exposure"] >= part["exposure"].min()
        # All rows of the detector from one exposure on, in the middle half of the orbit.
        np.testing.assert_array_equal(is_moved, same & later)
        assert 24 <= part["exposure"].min() <= 72
        return part, rows[same & ~later]

    return split


def as_on_another(measure, part, **change):
    """Return the shift of rows on a detector with other nominal values."""
    number = int(part["detector_id"].iloc[0])
    detectors = list(MINI_MOCK.detectors)
    values = {name: getattr(detectors[number], name) + value for name, value in change.items()}
    detectors[number] = replace(detectors[number], **values)
    other = measure(settings=QUIET, instrument=replace(MINI_MOCK, detectors=tuple(detectors)))
    found = other.measurements.set_index(KEY).reindex(part.set_index(KEY).index)
    return found[["nx", "ny"]].to_numpy() - part[["nx", "ny"]].to_numpy()


def test_shift_is_that_of_a_displaced_detector(moved, measure):
    part, before = moved("detector-shift=2um")
    shift = on_focal_plane(part, "dx", "dy")
    np.testing.assert_allclose(np.linalg.norm(shift, axis=1), 2.0, rtol=1e-6)
    # The star stays: it moves on the detector against the motion.
    x, y = -shift.mean(axis=0)
    expected = as_on_another(measure, part, x_um=x, y_um=y)
    known = np.isfinite(expected).all(axis=1)
    assert known.mean() > 0.95
    np.testing.assert_allclose(part[["dx", "dy"]][known], expected[known], rtol=0, atol=1e-7)
    assert len(before)


def test_turn_is_that_of_a_rotated_detector(moved, measure):
    part, before = moved("detector-turn=20arcsec")
    expected = as_on_another(measure, part, rotation_deg=20.0 / 3600.0)
    known = np.isfinite(expected).all(axis=1)
    assert known.mean() > 0.95
    np.testing.assert_allclose(part[["dx", "dy"]][known], expected[known], rtol=0, atol=1e-7)
    radius = np.hypot(part["nx"], part["ny"])
    np.testing.assert_allclose(
        np.hypot(part["dx"], part["dy"]), radius * np.radians(20.0 / 3600.0), rtol=1e-4
    )
    assert len(before)


def test_another_orbit_moves_another_detector_or_at_another_time():
    chosen = {
        motion(AppliedDefect("detector-shift", 1.0, QUIET, number), 4, 96)[:2]
        for number in range(20)
    }
    assert {detector for detector, _ in chosen} == {0, 1, 2, 3}
    assert len(chosen) > 10


def test_charge_transfer_follows_rows_and_magnitude(compare):
    rows = compare("charge-transfer=5mpix")
    crossed = rows["ny"] / 1920.0 + 0.5
    flux = 10.0 ** (-0.4 * (rows["magnitude"] - 17.0))
    np.testing.assert_allclose(rows["dy"], 5e-3 * crossed / np.sqrt(flux), rtol=0, atol=1e-10)
    assert rows["dx"].abs().max() < 1e-12


def test_pixel_phase_is_a_sine_of_the_position_in_the_pixel(compare):
    rows = compare("pixel-phase=3mpix")
    for axis in "xy":
        phase = np.mod(rows[f"n{axis}"], 1.0)
        expected = 3e-3 * np.sin(2.0 * np.pi * phase)
        np.testing.assert_allclose(rows[f"d{axis}"], expected, rtol=0, atol=1e-9)
        assert np.ptp(phase) > 0.95
