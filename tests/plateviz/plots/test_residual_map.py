import holoviews as hv
import numpy as np
import pandas as pd
import pytest

from plateviz import tables
from plateviz.plots import plot_residual_map
from tests.plateviz.plots.drawn import shafts_of


@pytest.fixture(scope="module")
def on_detector(fit_result, instrument):
    return tables.residual_map(fit_result, instrument, detector_id=2)


def _named(overlay, name):
    return next(e for e in overlay if e.label == name)


def _lengths(overlay):
    shafts = shafts_of(overlay)
    return np.hypot(shafts["x_end"] - shafts["x"], shafts["y_end"] - shafts["y"]).to_numpy()


def _subtitle(overlay):
    figure = hv.render(overlay, backend="bokeh")
    return " ".join(title.text for title in figure.above)


def _times_ten(table):
    names = ["u", "v", "residual_x_mpix", "residual_y_mpix", "residual_x_mas", "residual_y_mas"]
    return table.assign(**{name: 10.0 * table[name] for name in names})


def test_ten_times_the_residual_is_drawn_ten_times_as_long(on_detector, instrument):
    detector = instrument.detectors[2]
    one = plot_residual_map(on_detector, detector, arrow_scale=5000.0)
    ten = plot_residual_map(_times_ten(on_detector), detector, arrow_scale=5000.0)
    assert np.allclose(_lengths(ten), 10.0 * _lengths(one))
    assert np.allclose(_lengths(one), 5000.0 * np.hypot(on_detector["u"], on_detector["v"]))


def test_hover_shows_the_true_residual_and_the_exact_id(on_detector, instrument):
    table = _times_ten(on_detector)
    tails = _named(plot_residual_map(table, instrument.detectors[2]), "tails").dframe()
    assert np.array_equal(tails["residual_x_mpix"], table["residual_x_mpix"])
    assert tails["id"].tolist() == [str(i) for i in table["source_id"].tolist()]


def test_subtitle_states_the_scale_in_pixels_and_mas(on_detector, instrument):
    overlay = plot_residual_map(on_detector, instrument.detectors[2], arrow_scale=5000.0)
    assert "Arrows enlarged 5,000 times; key: 0.02 pix = 8.5 mas" in _subtitle(overlay)


def test_key_arrow_is_drawn_to_the_scale_of_the_arrows(on_detector, instrument):
    overlay = plot_residual_map(on_detector, instrument.detectors[2], arrow_scale=5000.0)
    shaft = _named(overlay, "key").dframe().iloc[0]
    assert shaft["x_end"] - shaft["x"] == pytest.approx(5000.0 * 0.02)


def test_axes_are_equal_in_pixels_and_cover_the_detector(on_detector, instrument):
    figure = hv.render(plot_residual_map(on_detector, instrument.detectors[2]), backend="bokeh")
    x, y = figure.x_range, figure.y_range
    assert x.start < -960
    assert x.end > 960
    scale = figure.frame_width / (x.end - x.start)
    assert scale == pytest.approx(figure.frame_height / (y.end - y.start), rel=2e-3)
    assert "(pix)" in figure.xaxis.axis_label
    assert "(pix)" in figure.yaxis.axis_label


def test_whole_focal_plane_is_drawn_in_mm(fit_result, instrument):
    table = tables.residual_map(fit_result, instrument, exposures=[(0, 0)])
    figure = hv.render(plot_residual_map(table, instrument), backend="bokeh")
    assert figure.xaxis.axis_label == "focal-plane x (mm)"
    assert "µm = " in _subtitle(plot_residual_map(table, instrument))


def test_above_two_thousand_arrows_the_mean_of_each_bin_is_drawn(on_detector, instrument):
    table = pd.concat([on_detector] * 12, ignore_index=True)
    overlay = plot_residual_map(table, instrument.detectors[2])
    assert len(table) > 2000
    assert 0 < len(_named(overlay, "tails")) <= 256
    assert f"{len(table):,} measurements: mean residual in" in _subtitle(overlay)


def test_no_vector_field_is_used(on_detector, instrument):
    overlay = plot_residual_map(on_detector, instrument.detectors[2])
    assert not any(isinstance(element, hv.VectorField) for element in overlay)
