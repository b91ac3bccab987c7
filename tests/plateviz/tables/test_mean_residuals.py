"""Mean residuals in bins, against fields and fits that are known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz import tables
from plateviz.tables.chance import largest_by_chance
from plateviz.tables.focal_residuals import focal_residuals
from tests.plateviz.tables.fields import (
    SIGMA_MPIX,
    left_by_sources,
    with_field,
    with_fitted_sources,
    without_absorption,
)


@pytest.fixture(scope="module")
def result(make_fit_result):
    return make_fit_result(5, n_sources=1200)[0]


def in_bin(at, row):
    return (
        (at[:, 0] >= row["left"])
        & (at[:, 0] < row["right"])
        & (at[:, 1] >= row["bottom"])
        & (at[:, 1] < row["top"])
    )


def test_means_and_sigmas_without_absorption_are_plain_ones(result, instrument):
    known = without_absorption(result)
    found, table = focal_residuals(known, instrument), tables.mean_residuals(known, instrument)
    # Of the means, four are of the pointing, roll and focal length.
    share = 1.0 - 4.0 / (2.0 * len(table))
    for _, row in table.iloc[::17].iterrows():
        inside = in_bin(found.at, row)
        assert row["n"] == inside.sum()
        x, y = share * row["mean_x_mpix"], share * row["mean_y_mpix"]
        assert np.allclose((x, y), found.vector[inside].mean(axis=0))
        sigma = SIGMA_MPIX / np.sqrt(row["n"] * share)
        assert row["sigma_x_mpix"] == pytest.approx(sigma, rel=1e-5)


def test_displacement_of_one_bin_is_found_at_its_size(result, instrument):
    fitted = with_fitted_sources(result)
    table = tables.mean_residuals(fitted, instrument)
    share = 1.0 - 4.0 / (2.0 * len(table))
    at = focal_residuals(fitted, instrument).at
    for number in (3, len(table) // 2):
        field = np.outer(in_bin(at, table.loc[number]), (3.0, -2.0))
        moved = with_field(fitted, left_by_sources(fitted, field))
        row = tables.mean_residuals(moved, instrument).loc[number]
        assert row["mean_x_mpix"] * share == pytest.approx(3.0, rel=1e-3)
        assert row["mean_y_mpix"] * share == pytest.approx(-2.0, rel=1e-3)
        # The mean of what is left of it is clearly smaller.
        assert left_by_sources(fitted, field)[in_bin(at, table.loc[number]), 0].mean() < 2.5


def test_noise_has_the_stated_scatter(result, instrument):
    fitted, random = with_fitted_sources(result), np.random.default_rng(2)
    spreads = []
    for _ in range(8):
        noise = SIGMA_MPIX * random.standard_normal((len(fitted.residuals), 2))
        left = with_field(fitted, left_by_sources(fitted, noise))
        spreads.append(tables.map_statistics(tables.mean_residuals(left, instrument)).spread)
    # Nothing is fitted here but the sources, where the table counts on four parameters more.
    bins = len(tables.mean_residuals(fitted, instrument))
    expected = np.sqrt(1.0 / (1.0 - 4.0 / (2.0 * bins)))
    assert np.mean(spreads) == pytest.approx(expected, abs=4.0 / np.sqrt(8 * 4 * bins))


def test_parameters_of_the_calibration_lower_what_is_left_by_their_number(result, instrument):
    known = without_absorption(result)
    measured = replace(known, calibration=known.calibration.assign(prior_share=0.25))
    before, after = (tables.mean_residuals(one, instrument) for one in (known, measured))
    means, parameters = 2.0 * len(before), 0.75 * (4 * 5 + 2 * 18)
    ratio = (means - 4.0) / (means - 4.0 - parameters)
    assert np.allclose((after["sigma_y_mpix"] / before["sigma_y_mpix"]) ** 2, ratio)


def test_bins_are_squares_that_fill_the_detectors(result, instrument):
    table = tables.mean_residuals(without_absorption(result), instrument, bins=4)
    assert len(table) == 4 * 16
    assert table["n"].sum() == len(result.residuals)
    assert np.allclose(table["right"] - table["left"], 4.8)
    assert np.allclose(table["top"] - table["bottom"], 4.8)
    for detector in instrument.detectors:
        rows = table[table["detector_id"] == detector.detector_id]
        low, high = (f(detector.corners_um(), axis=0) / 1000.0 for f in (np.min, np.max))
        assert np.allclose((rows["left"].min(), rows["bottom"].min()), low)
        assert np.allclose((rows["right"].max(), rows["top"].max()), high)


def test_number_of_bins_follows_the_number_of_measurements(result, instrument):
    whole = without_absorption(result)
    rows = whole.residuals
    one = replace(whole, residuals=rows[(rows["field_id"] == 0) & (rows["plate_id"] == 0)])
    few, all_of_them = (tables.mean_residuals(part, instrument) for part in (one, whole))
    assert len(few) < len(all_of_them)
    assert few["n"].mean() > 5
    assert all_of_them["n"].mean() > 40


def test_bins_in_which_the_sources_absorb_all_have_no_row(result, instrument):
    """A source that is measured once fits its measurement."""
    one = result.residuals.drop_duplicates("source_id")
    sources = result.sources[result.sources["source_id"].isin(one["source_id"])].assign(n_obs=1)
    single = with_fitted_sources(replace(result, residuals=one, sources=sources))
    assert tables.mean_residuals(single, instrument).empty


def test_sparse_bins_have_no_row(result, instrument):
    at = focal_residuals(result, instrument).at
    in_corner = (at > 15.0).all(axis=1)
    thinned = result.residuals[~in_corner | (np.arange(len(at)) % 20 == 0)]
    known = without_absorption(replace(result, residuals=thinned))
    table = tables.mean_residuals(known, instrument, bins=8)
    assert not ((table["left"] > 15.0) & (table["bottom"] > 15.0)).any()
    assert ((table["right"] < -15.0) & (table["top"] < -15.0)).any()


def test_summary_has_scatter_and_largest_bin_with_its_limit(result, instrument):
    table = tables.mean_residuals(result, instrument).assign(pull_x=1.0, pull_y=1.0)
    table.loc[4, "pull_y"] = -9.0
    found = tables.map_statistics(table)
    count = 2 * len(table)
    assert found.largest == 9.0
    assert found.spread == pytest.approx(np.sqrt((count + 80.0) / count))
    # Bonferroni's limit is close to it.
    assert found.limit == pytest.approx(largest_by_chance(1, 0.01 / count), rel=1e-3)
    assert found.sigma_mas / found.sigma_mpix == pytest.approx(0.4244, rel=1e-3)


def test_detectors_have_their_own_scatter_and_limit(result, instrument):
    table = tables.mean_residuals(result, instrument).assign(pull_x=1.0, pull_y=1.0)
    on_it = table["detector_id"] == 2
    table.loc[table.index[on_it][1], "pull_x"] = 3.8
    found = tables.detector_statistics(table).set_index("detector_id")
    assert found.index.tolist() == [d.detector_id for d in instrument.detectors]
    assert found["bins"].sum() == len(table)
    assert found["n"].sum() == table["n"].sum()
    count = 2 * int(on_it.sum())
    assert found.loc[2, "bins"] == on_it.sum()
    assert found.loc[2, "spread"] == pytest.approx(np.sqrt((count - 1.0 + 3.8**2) / count))
    assert found.loc[2, "spread_scatter"] == pytest.approx(1.0 / np.sqrt(2.0 * count))
    assert found["largest"].tolist() == [1.0, 1.0, 3.8, 1.0]
    assert found.loc[2, "limit"] == largest_by_chance(count)
    assert found["is_beyond"].tolist() == [False, False, True, False]
    # Among the bins of all detectors it would be none.
    assert not tables.map_statistics(table).largest > tables.map_statistics(table).limit


def test_noise_on_each_detector_scatters_and_is_beyond_its_limit_as_stated(result, instrument):
    fitted, random = with_fitted_sources(result), np.random.default_rng(5)
    found = []
    for _ in range(30):
        noise = SIGMA_MPIX * random.standard_normal((len(fitted.residuals), 2))
        left = with_field(fitted, left_by_sources(fitted, noise))
        found.append(tables.detector_statistics(tables.mean_residuals(left, instrument)))
    every = pd.concat(found)
    # Nothing is fitted here but the sources, where the table counts on four parameters more.
    share = 1.0 - 4.0 / (2.0 * every["bins"].groupby(every.index).first().sum())
    z = (every["spread"] * np.sqrt(share) - 1.0) / every["spread_scatter"]
    assert z.mean() == pytest.approx(0.0, abs=0.37)
    assert z.std() == pytest.approx(1.0, abs=4.0 / np.sqrt(2.0 * len(z)))
    assert every["is_beyond"].mean() < 0.01 + 4.0 * np.sqrt(0.01 / len(every))


def test_displaced_bin_is_beyond_the_limit_of_its_detector_alone(result, instrument):
    fitted, random = with_fitted_sources(result), np.random.default_rng(7)
    table = tables.mean_residuals(fitted, instrument)
    bins = table.index[table["detector_id"] == 1]
    row = table.loc[bins[len(bins) // 2]]
    at = focal_residuals(fitted, instrument).at
    noise = SIGMA_MPIX * random.standard_normal((len(at), 2))
    noise[in_bin(at, row), 0] += 8.0 * row["sigma_x_mpix"]
    moved = with_field(fitted, left_by_sources(fitted, noise))
    found = tables.detector_statistics(tables.mean_residuals(moved, instrument))
    assert found.loc[found["is_beyond"], "detector_id"].tolist() == [1]


def test_no_bins_have_no_detectors(result, instrument):
    none = tables.detector_statistics(tables.mean_residuals(result, instrument).head(0))
    assert none.empty
    assert "limit" in none
