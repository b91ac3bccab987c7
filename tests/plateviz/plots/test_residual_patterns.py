"""Contents of the binned residuals, the mean residual map, shifts and the correlation."""

import numpy as np
import pytest

from plateviz import plots, tables
from plateviz.figures.figure import Ramp
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.gallery import diagnostics
from tests.plateviz.plots.drawn import subtitle_of

NAMES = [
    "binned-residuals",
    "mean-residual-map",
    "field-residuals",
    "detector-shifts",
    "residual-correlation",
]


@pytest.fixture(scope="module")
def means(fit_result, instrument):
    return tables.mean_residuals(fit_result, instrument)


@pytest.fixture(scope="module")
def binned(fit_result, instrument):
    return tables.binned_residuals(fit_result, instrument)


@pytest.fixture(scope="module")
def shifts(fit_result, instrument):
    return tables.detector_shifts(fit_result, instrument)


@pytest.fixture(scope="module")
def correlation(fit_result, instrument):
    return tables.residual_correlation(fit_result, instrument)


def test_colours_of_the_map_are_symmetric_about_zero_to_four_sigma(means, instrument):
    sigma = tables.map_statistics(means).sigma_mpix
    for frame, axis in zip(plots.plot_mean_residual_map(means, instrument), "xy", strict=True):
        ramp = frame["bins"].looks["fill_color"]
        assert isinstance(ramp, Ramp)
        assert ramp.palette == "difference"
        assert ramp.column == f"mean_{axis}_mpix"
        assert ramp.limits == pytest.approx((-4.0 * sigma, 4.0 * sigma))
        assert ramp.label == "mpix"


def test_bins_of_the_map_are_drawn_where_they_are(means, instrument):
    x, y = plots.plot_mean_residual_map(means, instrument)
    for frame in (x, y):
        for name in ("left", "right", "bottom", "top"):
            assert np.array_equal(frame["bins"].values(name), means[name])
        assert len(frame["outlines"]) == len(instrument.detectors)
    assert not np.array_equal(x["bins"].columns["mean_x_mpix"], y["bins"].columns["mean_y_mpix"])


def test_map_states_what_chance_does(means, instrument):
    table = means.assign(pull_x=0.5)
    table.loc[0, "pull_x"] = -7.04
    found = tables.map_statistics(table)
    x, y = map(subtitle_of, plots.plot_mean_residual_map(table, instrument))
    assert f"± {found.sigma_mpix:.2g} mpix" in x
    assert f"{len(table)} bins" in x
    spread = f"{found.spread:.2f} ± {found.spread_scatter:.2f}"
    assert f"scatter {spread} times chance" in x
    assert f"largest 7.0σ (≤ {found.limit:.1f}σ)" in y


def test_map_names_the_detector_that_is_furthest_from_chance(means, instrument):
    table = means.assign(pull_x=0.5, pull_y=-0.5)
    at = table.index[table["detector_id"] == 2][3]
    table.loc[at, "pull_y"] = -7.04
    row = tables.detector_statistics(table).query("detector_id == 2").iloc[0]
    x, y = plots.plot_mean_residual_map(table, instrument)
    words = f"1 of 4 detectors beyond their limit; furthest 2: 7.0σ (≤ {row['limit']:.1f}σ)"
    assert words in subtitle_of(y)
    assert "detectors" not in subtitle_of(x)
    columns = y["bins"].columns
    for name in ("spread", "spread_scatter", "largest", "limit"):
        on_it = columns["detector_id"] == 2
        assert (columns[f"detector_{name}"][on_it] == row[name]).all()
    assert columns["detector_largest"].max() == pytest.approx(7.04)


def test_map_of_a_single_detector_says_nothing_of_detectors(means, instrument):
    one = means[means["detector_id"] == 1].reset_index(drop=True)
    _, y = plots.plot_mean_residual_map(one, instrument)
    assert "detectors" not in subtitle_of(y)


def test_each_field_has_a_panel_with_its_chi2(fit_result, instrument):
    table = tables.field_residuals(fit_result, instrument)
    frames = plots.plot_field_residuals(table, detectors=instrument.detectors)
    for frame, (field, rows) in zip(frames, table.groupby("field_id"), strict=True):
        found = tables.field_statistics(rows)
        assert frame.title.startswith(f"Field {field}")
        assert f"χ²/dof {found.chi2 / found.dof:.2f} (1 ± " in subtitle_of(frame)
        assert len(frame["tails"]) == len(rows)


def test_detectors_are_whole_however_large_the_bins_are(fit_result, instrument):
    table = tables.field_residuals(fit_result, instrument, bins=2)
    reach = max(abs(one.corners_um()).max() for one in instrument.detectors) / 1000.0
    for frame in plots.plot_field_residuals(table, detectors=instrument.detectors):
        assert frame.x.limits[0] < -reach
        assert frame.x.limits[1] > reach
        assert frame.y.limits[1] > reach


def test_each_quantity_has_a_panel_with_means_and_scatter(binned):
    frames = plots.plot_binned_residuals(binned)
    for frame, (name, rows) in zip(frames, binned.groupby("quantity", sort=False), strict=True):
        assert frame.title.lower().endswith(name)
        assert frame.x.label == f"{name} ({rows['unit'].iloc[0]})"
        for series, pull in (("mean x", "pull_x"), ("mean y", "pull_y"), ("scatter", "pull_chi2")):
            assert np.array_equal(frame[series].values("x"), rows["centre"])
            assert np.array_equal(frame[series].values("y"), rows[pull], equal_nan=True)
            assert np.array_equal(frame[f"line of {series}"].values("y"), rows[pull], True)


def test_panels_have_one_height_that_shows_the_limit_and_the_largest(binned):
    table = binned.copy()
    table.loc[3, "pull_y"] = -9.0
    limit = tables.bin_statistics(table).limit
    frames = plots.plot_binned_residuals(table)
    assert len({frame.y.limits for frame in frames}) == 1
    assert frames[0].y.limits[0] < -9.0
    for frame in frames:
        assert frame["limit"].values("y") == pytest.approx([-limit, limit])
        for k in (1, 2):
            assert (frame[f"{k}σ"].values("y0"), frame[f"{k}σ"].values("y1")) == ([-k], [k])


def test_panels_state_how_many_bins_are_beyond_two_sigma(binned):
    table = binned.assign(pull_x=0.0, pull_y=0.0, pull_chi2=0.0)
    table.loc[table.index[:3], "pull_chi2"] = 2.5
    first, second = map(subtitle_of, plots.plot_binned_residuals(table).frames[:2])
    values = 3 * (table["quantity"] == "time").sum()
    assert f"3 of {values} beyond ± 2σ, {0.0455 * values:.1f} expected" in first
    assert "largest 2.5σ, scatter" in first
    assert "0 of " in second


def test_shifts_have_the_band_of_chance_and_one_height(shifts):
    single = shifts[shifts["together"] == 1]
    sigma = tables.shift_statistics(single).sigma_mpix
    frames = plots.plot_detector_shifts(shifts)
    for frame in frames:
        for k in (1, 2):
            assert frame[f"{k}σ"].values("y1") == pytest.approx([k * sigma])
            assert frame[f"{k}σ"].values("y0") == pytest.approx([-k * sigma])
    assert frames[0].y.limits == frames[1].y.limits
    assert frames[0].y.limits[1] > single[["shift_x_mpix", "shift_y_mpix"]].abs().max().max()


def test_each_detector_has_points_and_a_line_of_means_in_one_colour(shifts, instrument):
    frame = plots.plot_detector_shifts(shifts)[1]
    for detector, colour in zip(instrument.detectors, SERIES_COLOURS, strict=False):
        name = f"detector {detector.detector_id}"
        rows = shifts[shifts["detector_id"] == detector.detector_id]
        points, means = rows[rows["together"] == 1], rows[rows["together"] == 6]
        assert np.array_equal(frame[name].values("y"), points["shift_y_mpix"])
        assert np.array_equal(frame[f"mean of {name}"].values("y"), means["shift_y_mpix"])
        bars = frame[f"error bars along y, {name}"]
        heights = bars.values("y1") - bars.values("y0")
        assert np.allclose(heights, 2.0 * means["sigma_y_mpix"])
        assert frame[name].looks["fill_color"] == colour
        assert frame[f"mean of {name}"].looks["line_color"] == colour


def test_shifts_state_how_many_are_beyond_two_sigma(shifts):
    table = shifts.assign(pull_x=0.0, pull_y=0.0)
    table.loc[table.index[:3], "pull_y"] = 2.5
    words = subtitle_of(plots.plot_detector_shifts(table)[1])
    assert f"3 of {2 * (table['together'] == 1).sum()} beyond ± 2σ" in words
    assert "largest 2.5σ, of the means 0.0σ" in words


def test_both_parts_of_the_correlation_are_drawn_over_the_band(correlation):
    (frame,) = plots.plot_residual_correlation(correlation)
    for part in "eb":
        assert np.array_equal(frame[part].values("y"), correlation[part])
        assert np.allclose(frame[part].values("x"), correlation["separation_mm"], rtol=0.03)
    band = frame["2σ"]
    assert np.allclose(band.values("y2")[1:-1], 2.0 * correlation["sigma"])
    assert np.allclose(band.values("y1"), -band.values("y2"))
    assert (band.values("x")[0], band.values("x")[-1]) == frame.x.limits
    assert frame.y.limits[1] >= max(band.values("y2").max(), correlation[["e", "b"]].max().max())


def test_correlation_states_the_largest_parts(correlation):
    (frame,) = plots.plot_residual_correlation(correlation.assign(pull_e=-4.2, pull_b=1.3))
    limit = tables.correlation_statistics(correlation).limit
    assert f"Largest E 4.2σ, B 1.3σ; chance exceeds {limit:.1f}σ" in subtitle_of(frame)
    assert "µas)²" in subtitle_of(frame) or "mas)²" in subtitle_of(frame)


@pytest.mark.parametrize("name", NAMES)
def test_diagnostics_are_in_the_gallery(fit_result, instrument, name):
    (diagnostic,) = [d for d in diagnostics() if d.name == name]
    chosen = Chosen(fit_result, instrument, exposures=((0, 0), (0, 1), (1, 0)))
    assert diagnostic.plot(chosen).message is None


def test_patterns_are_of_the_whole_orbit():
    assert not any(d.follows_shown for d in diagnostics() if d.name in NAMES)
