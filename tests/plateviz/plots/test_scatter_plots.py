import numpy as np
import pandas as pd
import pytest
from bokeh.models import LogScale

from plateviz import tables
from plateviz.figures.figure import By
from plateviz.plots import plot_deviation, plot_residual_scatter, plot_uncertainty
from plateviz.plots.elements.style import ROW_LIMIT, SERIES_COLOURS
from tests.plateviz.plots.drawn import plots_of, subtitle_of


@pytest.fixture(scope="module")
def scatter(fit_result):
    return tables.residual_scatter(fit_result, exposures=[(0, 0), (1, 1)])


@pytest.fixture(scope="module")
def deviations(fit_result, truth):
    return tables.deviation(fit_result, truth)


@pytest.fixture(scope="module")
def uncertainties(fit_result, instrument):
    return tables.uncertainty(fit_result, instrument)


@pytest.mark.parametrize(
    ("rows", "is_raster"), [(ROW_LIMIT, False), (ROW_LIMIT + 1, True)], ids=["at", "above"]
)
def test_scatter_is_rasterised_above_the_row_limit(scatter, rows, is_raster):
    table = pd.concat([scatter] * (rows // len(scatter) + 1), ignore_index=True).head(rows)
    (frame,) = plot_residual_scatter(table)
    kinds = {glyphs.kind for glyphs in frame.glyphs}
    assert ("image" in kinds) == is_raster
    assert ("points" in kinds) != is_raster


def test_raster_counts_every_measurement(scatter):
    table = pd.concat([scatter] * (ROW_LIMIT // len(scatter) + 1), ignore_index=True)
    (frame,) = plot_residual_scatter(table)
    assert np.nansum(frame["counts 0"].values("image")[0]) == len(table)


def test_scatter_circles_are_one_and_two_expected_sigmas(scatter):
    (frame,) = plot_residual_scatter(scatter)
    circles = [glyphs for glyphs in frame.glyphs if glyphs.kind == "line"]
    expected = np.sqrt(np.mean(scatter["expected_x_mpix"] ** 2))
    radii = [circle.values("x").max() for circle in circles]
    assert radii == pytest.approx([expected, 2.0 * expected])


def test_scatter_circles_are_as_high_as_the_noise_expected_along_y(scatter):
    (frame,) = plot_residual_scatter(scatter.assign(expected_x_mpix=9.0, expected_y_mpix=2.0))
    heights = [frame[name].values("y").max() for name in ("1σ", "2σ")]
    assert heights == pytest.approx([2.0, 4.0])


def test_scatter_states_its_statistics_and_units(scatter):
    (frame,) = plot_residual_scatter(scatter)
    rms = np.sqrt(np.mean(scatter["residual_x_mpix"] ** 2))
    assert f"rms x, y {rms:.2f}" in subtitle_of(frame)
    assert f"n = {len(scatter)}" in subtitle_of(frame)
    assert frame.x.label == "residual x (mpix)"
    assert frame.width == frame.frame_height


@pytest.mark.parametrize(("n", "coloured"), [(6, True), (7, False)])
def test_scatter_is_coloured_by_exposure_up_to_six(fit_result, n, coloured):
    chosen = [(k // 3, k % 3) for k in range(n)]
    (frame,) = plot_residual_scatter(tables.residual_scatter(fit_result, exposures=chosen))
    colour = frame["measurements"].looks["fill_color"]
    if coloured:
        assert isinstance(colour, By)
        assert colour.column == "exposure"
        assert tuple(colour.looks.values()) == SERIES_COLOURS
        assert set(colour.looks) == set(frame["measurements"].columns["exposure"])
    else:
        assert colour == SERIES_COLOURS[0]


def test_deviation_has_a_panel_per_class_with_equal_axes(deviations):
    plots = plots_of(plot_deviation(deviations))
    assert len(plots) == 3
    for plot in plots:
        assert plot.frame_width == plot.frame_height
        assert plot.x_range.start == -plot.x_range.end == plot.y_range.end


def test_deviation_says_that_it_is_of_all_sources(deviations):
    figure = plot_deviation(deviations)
    for frame, name in zip(figure, ("reference", "artificial", "non-reference"), strict=True):
        rows = deviations[deviations["source_class"] == name]
        assert frame.title == f"All {name} sources"
        assert f"n = {len(rows):,}" in frame.subtitle


def test_deviation_of_reference_sources_is_in_microarcseconds(deviations):
    frame = plot_deviation(deviations)[0]
    rows = deviations[deviations["source_class"] == tables.REFERENCE]
    assert "µas" in frame.x.label
    assert frame["sources"].columns["id"].tolist() == rows["id"].tolist()
    assert np.allclose(frame["sources"].values("x"), 1000.0 * rows["deviation_ra_mas"])


def test_deviation_ellipse_is_the_mean_marginal_covariance(deviations):
    table = deviations.assign(sigma_ra_mas=3.0, sigma_dec_mas=1.0, corr=0.0)
    table = table[table["source_class"] == tables.NON_REFERENCE]
    ellipse = plot_deviation(table)[0]["mean covariance"]
    assert np.abs(ellipse.values("x")).max() == pytest.approx(3.0, rel=1e-3)
    assert np.abs(ellipse.values("y")).max() == pytest.approx(1.0, rel=1e-2)


def test_deviation_ellipse_is_tilted_with_the_correlation(deviations):
    table = deviations.assign(sigma_ra_mas=2.0, sigma_dec_mas=2.0, corr=0.8)
    table = table[table["source_class"] == tables.NON_REFERENCE]
    ellipse = plot_deviation(table)[0]["mean covariance"]
    assert np.cov(ellipse.values("x"), ellipse.values("y"))[0, 1] > 0


def test_deviation_states_the_number_beyond_the_frame(deviations):
    table = deviations[deviations["source_class"] == tables.NON_REFERENCE].copy()
    table.iloc[0, table.columns.get_loc("deviation_ra_mas")] = 1e4
    (frame,) = plot_deviation(table)
    assert "1 beyond the frame" in subtitle_of(frame)


def test_deviation_without_truth_has_a_message(fit_result):
    figure = plot_deviation(tables.deviation(fit_result, None))
    assert figure.message == "No truth for this orbit"


@pytest.mark.parametrize(("coordinate", "panels"), [("ra", 1), ("dec", 1), ("both", 2)])
def test_uncertainty_draws_the_given_coordinates_in_log_log(uncertainties, coordinate, panels):
    figure = plot_uncertainty(uncertainties, coordinate=coordinate)
    plots = plots_of(figure)
    assert len(figure) == len(plots) == panels
    for frame, plot in zip(figure, plots, strict=True):
        assert frame.x.is_log
        assert frame.y.is_log
        assert isinstance(plot.x_scale, LogScale)
        assert isinstance(plot.y_scale, LogScale)
        assert "(mas)" in frame.y.label


def test_uncertainty_law_falls_with_the_square_root_of_n(uncertainties):
    law = plot_uncertainty(uncertainties, coordinate="ra")[0]["law"]
    product = law.values("y") * np.sqrt(law.values("x"))
    assert np.allclose(product, uncertainties["sigma_single_mas"].iloc[0])


def test_uncertainty_above_the_row_limit_is_drawn_as_medians(uncertainties):
    many = pd.concat([uncertainties] * 60, ignore_index=True)
    (frame,) = plot_uncertainty(many, coordinate="dec")
    assert 0 < len(frame["sources"]) < 200
    assert len(frame["ranges"]) == len(frame["sources"])
    assert "median and 16–84 % range" in subtitle_of(frame)


@pytest.mark.parametrize("size", [1e-3, 1.0, 400.0], ids=["µas", "mas", "hundreds of mas"])
def test_deviation_panels_have_subtitles_of_equal_height(deviations, size):
    names = ["deviation_ra_mas", "deviation_dec_mas"]
    table = deviations.assign(**{name: size * deviations[name] for name in names})
    plots = plots_of(plot_deviation(table, width=270))
    assert len({title.text.count("\n") for plot in plots for title in plot.above}) == 1
