"""Magnitudes in the tables of a survey, and noise that depends on them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.magnitudes import draw_magnitudes, noise_factor
from solver.simulate.measure import measure_orbit
from solver.simulate.settings import SurveySettings

WITHOUT = SurveySettings(orbits=3, n_stars=2500, n_reference=600, n_artificial=40)
WITH = replace(WITHOUT, magnitudes=True)


@pytest.fixture(scope="module")
def truth():
    return truth_catalogue(WITH)


def test_magnitudes_change_no_other_column(truth):
    before = truth_catalogue(WITHOUT)
    pd.testing.assert_frame_equal(truth.drop(columns="magnitude"), before.drop(columns="magnitude"))
    assert before["magnitude"].isna().all()
    assert truth["magnitude"].between(8.0, 19.5).all()
    first, second = (
        measure_orbit(0, table, settings).measurements.drop(columns="magnitude")
        for table, settings in ((before, WITHOUT), (truth, WITH))
    )
    pd.testing.assert_frame_equal(first, second)


def test_counts_grow_by_0_35_dex_per_magnitude():
    drawn = draw_magnitudes(np.random.default_rng(1), 200_000)
    counts = np.log10(np.histogram(drawn, np.arange(12.0, 19.1))[0])
    np.testing.assert_allclose(np.diff(counts), 0.35, atol=0.03)


def test_magnitude_is_the_one_that_made_the_parallax_error(truth):
    stars = truth[~truth["is_artificial"]]
    # Gaia's mission performance model, without the scatter of 10 %.
    z = 10.0 ** (0.4 * (np.maximum(stars["magnitude"], 13.0) - 15.0))
    ratio = stars["parallax_error"] / (1e-3 * np.sqrt(40.0 + 800.0 * z + 30.0 * z**2))
    assert np.log(ratio).std() == pytest.approx(0.1, rel=0.1)


def test_catalogue_and_measurements_have_the_magnitude_of_the_source(truth):
    own = truth.set_index("source_id")["magnitude"]
    for table in (reference_catalogue(truth, WITH), measure_orbit(0, truth, WITH).measurements):
        np.testing.assert_array_equal(table["magnitude"], own[table["source_id"]])


def test_noise_by_magnitude_is_stated_and_made(truth):
    quiet, noisy = (
        measure_orbit(1, truth, replace(WITH, noise_by_magnitude=True, measurement_mas=mas))
        for mas in (1e-9, 4.0)
    )
    rows = noisy.measurements
    expected = np.radians(4e-3 / 3600.0) * 4.86e6 / 10.0
    assert noise_factor(np.array([17.0]))[0] == pytest.approx(1.0)
    # Photon noise: 100 times the flux, a tenth of it, beside a floor of a quarter.
    assert noise_factor(np.array([12.0]))[0] == pytest.approx(
        np.hypot(0.25, 0.1 * 0.9682), rel=1e-3
    )
    np.testing.assert_allclose(rows["sx"], expected * noise_factor(rows["magnitude"].to_numpy()))
    pulls = (rows["nx"] - quiet.measurements["nx"]) / rows["sx"]
    for part in (rows["magnitude"] < 16.0, rows["magnitude"] > 18.0):
        assert part.sum() > 100
        assert pulls[part].std() == pytest.approx(1.0, abs=5.0 / np.sqrt(2.0 * part.sum()))
