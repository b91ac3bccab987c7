"""The true calibration of an orbit, against the displacements that its defects make."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.legendre import legval2d

from solver.data.instrument import MINI_MOCK
from solver.simulate.defects.defect import DefectStage, TrueRows
from solver.simulate.defects.stages import applied_defects
from solver.simulate.placement import place_detectors
from solver.simulate.schedule import orbit_schedule
from solver.simulate.settings import SurveySettings
from solver.simulate.true_calibration import true_calibration

ORBIT = 1
SETTINGS = SurveySettings(orbits=3, seed=4, detector_offset_um=30.0)


def truth_of(settings, exposures=None):
    exposures = orbit_schedule(ORBIT, settings) if exposures is None else exposures
    return true_calibration(settings, MINI_MOCK, exposures)


def displaced(coefficients, places):
    """Sum the terms, in the documented order, at places in um."""
    order = next(n for n in range(10) if (n + 1) * (n + 2) // 2 - 3 == len(coefficients))
    degrees = [(n - j, j) for n in range(2, order + 1) for j in range(n + 1)]
    total = np.zeros_like(places)
    for (k, j), pair in zip(degrees, coefficients, strict=True):
        one = np.zeros((order + 1, order + 1))
        one[k, j] = 1.0
        value = legval2d(*(places / MINI_MOCK.distortion_scale_um).T, one)
        total += np.outer(value - legval2d(0.0, 0.0, one), pair)
    return total


def rows_of(schedule, settings):
    """Return the same places of a grid, and the same pixels of each detector, in every exposure."""
    side = np.linspace(-900.0, 900.0, 5)
    grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    one = np.tile(np.repeat(np.arange(4), len(grid)), len(schedule))
    return TrueRows(
        exposure=np.repeat(np.arange(len(schedule)), 4 * len(grid)),
        detector=one,
        ideal=20.0 * np.tile(grid, (4 * len(schedule), 1)),
        pixel=np.tile(grid, (4 * len(schedule), 1)),
        magnitude=np.full(len(one), np.nan),
        attitude=schedule,
        instrument=place_detectors(MINI_MOCK, settings),
    )


def mean_of(settings, stage, is_used):
    """Return the rows of one exposure, and the mean displacement by the defects of a stage."""
    schedule = orbit_schedule(ORBIT, settings)
    rows = rows_of(schedule, settings)
    total = sum(defect.apply(one, rows) for defect, one in applied_defects(settings, stage, ORBIT))
    first = rows.exposure == 0
    mean = np.reshape(total, (len(schedule), -1, 2))[is_used].mean(axis=0)
    return rows.ideal[first], rows.pixel[first], rows.detector[first], mean


def test_without_defects_it_is_as_in_the_settings():
    truth = truth_of(SETTINGS)
    assert truth.instrument == place_detectors(MINI_MOCK, SETTINGS) != MINI_MOCK
    degrees = [(n - j, j) for n in range(2, 6) for j in range(n + 1)]
    found = {d: tuple(pair) for d, pair in zip(degrees, truth.coefficients, strict=True)}
    given = {(k, j): (a, b) for k, j, a, b in SETTINGS.distortion_um}
    assert {d: pair for d, pair in found.items() if any(pair)} == given
    assert truth.averaged == truth.left_out == ()


@pytest.mark.parametrize(
    "defects",
    [
        ("distortion-drift=0.1um",),
        ("distortion-orbital=200nm", "distortion-step=50nm"),
        ("distortion-order=50nm",),
    ],
    ids=lambda defects: defects[0].partition("=")[0],
)
def test_distortion_of_defects_is_its_mean_over_the_exposures_used(defects):
    settings = replace(SETTINGS, defects=defects)
    schedule = orbit_schedule(ORBIT, settings)
    # Another part of the orbit has another mean.
    is_used = np.arange(len(schedule)) >= 40
    places, _, _, mean = mean_of(settings, DefectStage.FOCAL_PLANE, is_used)
    truth = truth_of(settings, schedule[is_used])
    before = displaced(truth_of(SETTINGS).coefficients, places)
    assert np.abs(mean).max() > 1e-3
    np.testing.assert_allclose(
        displaced(truth.coefficients, places), before + mean, rtol=0, atol=1e-12
    )
    assert bool(truth.averaged) == (defects[0] != "distortion-order=50nm")


@pytest.mark.parametrize("defect", ["detector-shift=0.1um", "detector-turn=2arcsec"])
def test_moving_detector_is_at_its_mean_place(defect):
    settings = replace(SETTINGS, defects=(defect,))
    _, pixel, detector, mean = mean_of(settings, DefectStage.DETECTOR, slice(None))
    before, after = (truth_of(one).instrument.detectors for one in (SETTINGS, settings))
    expected = []
    for (x, y), number in zip(pixel, detector, strict=True):
        # Where a star at that pixel of the detector's old place lies on its new one.
        a, b = before[number], after[number]
        turn_a, turn_b = np.radians([a.rotation_deg, b.rotation_deg])
        focal = complex(x * a.pitch_x_um, y * a.pitch_y_um) * np.exp(-1j * turn_a)
        focal += complex(a.x_um - b.x_um, a.y_um - b.y_um)
        there = focal * np.exp(1j * turn_b)
        expected.append((there.real / b.pitch_x_um - x, there.imag / b.pitch_y_um - y))
    assert np.abs(mean).max() > 1e-3
    np.testing.assert_allclose(mean, expected, rtol=0, atol=1e-6)


def test_what_is_no_calibration_is_named():
    truth = truth_of(replace(SETTINGS, defects=("charge-transfer=5mpix", "noise=10%")))
    assert len(truth.left_out) == 1
    assert "magnitude" in truth.left_out[0]


def test_orbit_of_another_origin_has_no_truth():
    exposures = orbit_schedule(ORBIT, SETTINGS).assign(orbit_id=3)
    assert truth_of(SETTINGS, exposures) is None
