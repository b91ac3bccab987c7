"""Defects on the focal plane: coefficients recovered from the measurements by least squares."""

import numpy as np
import pandas as pd
import pytest
from numpy.polynomial.legendre import legval2d

from solver.data.instrument import MINI_MOCK
from solver.simulate.defects.defect import AppliedDefect, TrueRows
from solver.simulate.defects.distortion_terms import changing_with_orbits
from solver.simulate.defects.optics import focal_trend, pointing_jitter
from tests.solver.simulate.defects.conftest import ORBIT, SETTINGS, on_focal_plane, places


def coefficients(rows, degrees, change=1.0):
    """Fit Legendre terms of some degrees to the shifts, and return them and what they leave."""
    at = places(rows) / MINI_MOCK.distortion_scale_um
    columns = []
    for degree in degrees:
        for j in range(degree + 1):
            one = np.zeros((8, 8))
            one[degree - j, j] = 1.0
            columns.append((legval2d(*at.T, one) - legval2d(0.0, 0.0, one)) * change)
    design, shift = np.stack(columns, axis=1), on_focal_plane(rows, "dx", "dy")
    found = np.linalg.lstsq(design, shift)[0]
    return found, shift - design @ found


def time_of(rows, measure):
    """Return the time of each row, in seconds after the first exposure."""
    time = measure().attitude["obstime"].to_numpy()
    return 86_400.0 * (time - time[0])[rows["exposure"]]


def test_drift_changes_the_quadratic_terms_by_its_amplitude(compare, measure):
    rows = compare("distortion-drift=0.1um")
    seconds = time_of(rows, measure)
    found, left = coefficients(rows, (2,), seconds / seconds.max() - 0.5)
    assert np.linalg.norm(found) == pytest.approx(0.1, rel=1e-4)
    assert np.abs(left).max() < 1e-5


def test_trend_of_the_distortion_is_that_between_the_first_and_the_last_orbit(measure):
    attitude = measure().attitude
    first, middle, last = (
        changing_with_orbits(AppliedDefect("distortion-trend", 0.05, SETTINGS, orbit), attitude)
        for orbit in (0, ORBIT, SETTINGS.orbits - 1)
    )
    assert {sum(pair) for pair in first.degrees} == {2}
    assert np.linalg.norm(last.coefficients) == pytest.approx(0.05)
    assert np.ptp(last.change) == 0.0
    assert [one.change[0] for one in (first, middle, last)] == [-0.5, 0.0, 0.5]


def test_trend_of_the_focal_length_is_that_between_the_first_and_the_last_orbit(measure):
    attitude = measure().attitude
    ideal = np.array([[1000.0, -2000.0]])
    one, nothing = np.zeros(1, dtype=int), np.zeros((1, 2))
    rows = TrueRows(one, one, ideal, nothing, np.zeros(1), attitude, MINI_MOCK)
    moved = [
        focal_trend(AppliedDefect("focal-trend", 1e-3, SETTINGS, orbit), rows)
        for orbit in (0, SETTINGS.orbits - 1)
    ]
    np.testing.assert_allclose(moved[1] - moved[0], 1e-3 * ideal)
    np.testing.assert_allclose(moved[1], -moved[0])


def test_orbital_distortion_has_amplitude_and_period(compare, measure):
    rows = compare("distortion-orbital=200nm")
    seconds = time_of(rows, measure)
    # Kepler's third law, 600 km above the Earth.
    period = 2.0 * np.pi * np.sqrt((6378.137 + 600.0) ** 3 / 398_600.4418)
    angle = 2.0 * np.pi * seconds / period
    per_exposure = [coefficients(part, (2,))[0].ravel() for _, part in rows.groupby("exposure")]
    first = rows.groupby("exposure").head(1).index
    waves = np.stack([np.cos(angle[first]), np.sin(angle[first])], axis=1)
    found = np.linalg.lstsq(waves, np.array(per_exposure))[0]
    assert np.linalg.norm(found) == pytest.approx(0.2, rel=1e-3)
    assert np.abs(waves @ found - per_exposure).max() < 1e-3


def test_step_changes_the_cubic_terms_of_the_later_fields(compare):
    rows = compare("distortion-step=50nm")
    later = rows["field_id"] >= 2
    assert rows.loc[~later, ["dx", "dy"]].abs().max(axis=None) < 1e-9
    found, left = coefficients(rows[later], (3,))
    assert np.linalg.norm(found) == pytest.approx(0.05, rel=1e-4)
    assert np.abs(left).max() < 1e-5


def test_higher_order_is_six_and_seven_with_the_amplitude(compare):
    rows = compare("distortion-order=50nm")
    found, left = coefficients(rows, (6, 7))
    assert np.linalg.norm(found) == pytest.approx(0.05, rel=1e-3)
    assert (np.linalg.norm(found, axis=1) > 0.0).all()
    assert np.abs(left).max() < 1e-4


def test_anisotropy_scatters_by_its_amplitude_and_keeps_the_mean_focal_length(compare):
    rows = compare("focal-anisotropy=5ppm")
    place, shift = places(rows), on_focal_plane(rows, "dx", "dy")
    scale = pd.DataFrame(shift / place).groupby(rows["exposure"]).median()
    np.testing.assert_allclose(scale[0], -scale[1], rtol=0, atol=1e-10)
    ratio = scale[1] - scale[0]
    np.testing.assert_allclose(
        shift, 0.5 * place * np.outer(ratio[rows["exposure"]], (-1, 1)), rtol=0, atol=1e-5
    )
    assert ratio.std() == pytest.approx(5e-6, rel=4.0 / np.sqrt(2 * 96))


def test_jitter_is_in_three_exposures_and_depends_on_the_row_of_the_detector(compare):
    rows = compare("pointing-jitter=4mas")
    moved = rows[["dx", "dy"]].abs().max(axis=1) > 1e-7
    assert rows.loc[moved, "exposure"].nunique() == 3
    part = rows[moved & (rows["exposure"] == rows.loc[moved, "exposure"].iloc[0])]
    shift = on_focal_plane(part, "dx", "dy")
    # The same wave on all detectors: 4 cosines and 4 sines of the row.
    angle = 2.0 * np.pi * np.outer(part["ny"] / 1920.0 + 0.5, np.arange(1, 5))
    design = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    assert len(part) > 2 * design.shape[1]
    left = shift - design @ np.linalg.lstsq(design, shift)[0]
    assert np.abs(left).max() < 1e-5


def test_jitter_has_the_rms_of_its_amplitude_along_each_axis(measure):
    n_exposures, n_rows = 96, 2000
    exposure = np.repeat(np.arange(n_exposures), n_rows)
    y = np.tile((np.arange(n_rows) + 0.5) / n_rows * 1920.0 - 960.0, n_exposures)
    pixel = np.stack([np.zeros_like(y), y], axis=1)
    rows = TrueRows(
        exposure=exposure,
        detector=np.zeros_like(exposure),
        ideal=np.zeros_like(pixel),
        pixel=pixel,
        magnitude=np.zeros_like(y),
        attitude=measure().attitude,
        instrument=MINI_MOCK,
    )
    shift = pointing_jitter(AppliedDefect("pointing-jitter", 4.0, SETTINGS, ORBIT), rows)
    focal_length = measure().attitude["true_focal_length"].to_numpy()[exposure]
    mas = np.degrees(shift / focal_length[:, None]) * 3.6e6
    rms = np.sqrt(np.mean(mas.reshape(n_exposures, n_rows, 2) ** 2, axis=1))
    moving = rms.max(axis=1) > 0.0
    assert moving.sum() == 3
    np.testing.assert_allclose(rms[moving], 4.0, rtol=1e-6)
