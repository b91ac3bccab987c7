import holoviews as hv
import numpy as np
import pandas as pd
import pytest
from bokeh.models import Plot

from plateviz import tables
from plateviz.plots import plot_deviation, plot_residual_scatter, plot_uncertainty
from plateviz.plots.style import ROW_LIMIT


def _subtitle(figure):
    return " ".join(title.text for title in figure.above)


def _types(overlay):
    return {type(element) for element in overlay}


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
    overlay = plot_residual_scatter(table)
    assert (hv.Image in _types(overlay)) == is_raster
    assert (hv.Points in _types(overlay)) != is_raster


def test_raster_counts_every_measurement(scatter):
    table = pd.concat([scatter] * (ROW_LIMIT // len(scatter) + 1), ignore_index=True)
    image = next(e for e in plot_residual_scatter(table) if isinstance(e, hv.Image))
    assert np.nansum(image.dimension_values(2)) == len(table)


def test_scatter_circles_are_one_and_two_expected_sigmas(scatter):
    circles = [e for e in plot_residual_scatter(scatter) if isinstance(e, hv.Curve)]
    expected = np.sqrt(np.mean(scatter["expected_x_mpix"] ** 2))
    radii = [c.dimension_values(0).max() for c in circles]
    assert radii == pytest.approx([expected, 2.0 * expected])


def test_scatter_states_its_statistics_and_units(scatter):
    figure = hv.render(plot_residual_scatter(scatter), backend="bokeh")
    rms = np.sqrt(np.mean(scatter["residual_x_mpix"] ** 2))
    assert f"rms x {rms:.2f}" in _subtitle(figure)
    assert f"n = {len(scatter)}" in _subtitle(figure)
    assert figure.xaxis.axis_label == "residual x (mpix)"
    assert figure.frame_width == figure.frame_height


@pytest.mark.parametrize(("n", "coloured"), [(6, True), (7, False)])
def test_scatter_is_coloured_by_exposure_up_to_six(fit_result, n, coloured):
    chosen = [(k // 3, k % 3) for k in range(n)]
    overlay = plot_residual_scatter(tables.residual_scatter(fit_result, exposures=chosen))
    points = next(e for e in overlay if isinstance(e, hv.Points))
    assert (points.opts.get("style").kwargs["color"] == "exposure") == coloured


def test_deviation_has_a_panel_per_class_with_equal_axes(deviations):
    grid = hv.render(plot_deviation(deviations), backend="bokeh")
    figures = list(grid.select({"type": Plot}))
    assert len(figures) == 3
    for figure in figures:
        assert figure.frame_width == figure.frame_height
        assert figure.x_range.start == -figure.x_range.end == figure.y_range.end


def test_deviation_of_reference_sources_is_in_microarcseconds(deviations):
    panel = next(iter(plot_deviation(deviations)))
    figure = hv.render(panel, backend="bokeh")
    points = next(e for e in panel if isinstance(e, hv.Points))
    assert "µas" in figure.xaxis.axis_label
    assert np.allclose(
        points.dimension_values(0), 1000.0 * points.dimension_values("deviation_ra_mas")
    )


def test_deviation_ellipse_is_the_mean_marginal_covariance(deviations):
    table = deviations.assign(sigma_ra_mas=3.0, sigma_dec_mas=1.0, corr=0.0)
    table = table[table["source_class"] == tables.NON_REFERENCE]
    ellipse = next(e for e in next(iter(plot_deviation(table))) if isinstance(e, hv.Ellipse))
    points = ellipse.array()
    assert np.abs(points[:, 0]).max() == pytest.approx(3.0, rel=1e-3)
    assert np.abs(points[:, 1]).max() == pytest.approx(1.0, rel=1e-2)


def test_deviation_states_the_number_beyond_the_frame(deviations):
    table = deviations[deviations["source_class"] == tables.NON_REFERENCE].copy()
    table.iloc[0, table.columns.get_loc("deviation_ra_mas")] = 1e4
    figure = hv.render(next(iter(plot_deviation(table))), backend="bokeh")
    assert "1 beyond the frame" in _subtitle(figure)


def test_deviation_without_truth_has_a_message(fit_result):
    overlay = plot_deviation(tables.deviation(fit_result, None))
    text = next(e for e in overlay if isinstance(e, hv.Text))
    assert text.data[2] == "No truth for this orbit"


@pytest.mark.parametrize(("coordinate", "panels"), [("ra", 1), ("dec", 1), ("both", 2)])
def test_uncertainty_draws_the_given_coordinates_in_log_log(uncertainties, coordinate, panels):
    plot = hv.render(plot_uncertainty(uncertainties, coordinate=coordinate), backend="bokeh")
    figures = list(plot.select({"type": Plot}))
    assert len(figures) == panels
    for figure in figures:
        assert type(figure.x_scale).__name__ == type(figure.y_scale).__name__ == "LogScale"
        assert "(mas)" in figure.yaxis.axis_label


def test_uncertainty_law_falls_with_the_square_root_of_n(uncertainties):
    overlay = plot_uncertainty(uncertainties, coordinate="ra")
    law = next(e for e in overlay if isinstance(e, hv.Curve)).dframe()
    product = law["sigma_mas"] * np.sqrt(law["n_obs"])
    assert np.allclose(product, uncertainties["sigma_single_mas"].iloc[0])


def test_uncertainty_above_the_row_limit_is_drawn_as_medians(uncertainties):
    many = pd.concat([uncertainties] * 60, ignore_index=True)
    overlay = plot_uncertainty(many, coordinate="dec")
    points = next(e for e in overlay if isinstance(e, hv.Points))
    assert len(points) < 200
    assert "median and 16–84 % range" in _subtitle(hv.render(overlay, backend="bokeh"))


@pytest.mark.parametrize("size", [1e-3, 1.0, 400.0], ids=["µas", "mas", "hundreds of mas"])
def test_deviation_panels_have_subtitles_of_equal_height(deviations, size):
    names = ["deviation_ra_mas", "deviation_dec_mas"]
    table = deviations.assign(**{name: size * deviations[name] for name in names})
    grid = hv.render(plot_deviation(table, width=270), backend="bokeh")
    assert {_subtitle(f).count("\n") for f in grid.select({"type": Plot})} == {2}
