import numpy as np
import pandas as pd
import pytest

from plateviz import tables
from plateviz.plots import plot_residual_map
from tests.plateviz.plots.drawn import plots_of, shafts_of, subtitle_of


@pytest.fixture(scope="module")
def on_detector(fit_result, instrument):
    return tables.residual_map(fit_result, instrument, detector_id=2)


def _frame(table, detector, **options):
    (frame,) = plot_residual_map(table, detector, **options)
    return frame


def _lengths(frame):
    shafts = shafts_of(frame)
    return np.hypot(shafts["x1"] - shafts["x0"], shafts["y1"] - shafts["y0"]).to_numpy()


def _times_ten(table):
    names = ["u", "v", "residual_x_mpix", "residual_y_mpix", "residual_x_mas", "residual_y_mas"]
    return table.assign(**{name: 10.0 * table[name] for name in names})


def test_ten_times_the_residual_is_drawn_ten_times_as_long(on_detector, instrument):
    detector = instrument.detectors[2]
    one = _frame(on_detector, detector, arrow_scale=5000.0)
    ten = _frame(_times_ten(on_detector), detector, arrow_scale=5000.0)
    assert np.allclose(_lengths(ten), 10.0 * _lengths(one))
    assert np.allclose(_lengths(one), 5000.0 * np.hypot(on_detector["u"], on_detector["v"]))


def test_hover_shows_the_true_residual_and_the_exact_id(on_detector, instrument):
    table = _times_ten(on_detector)
    tails = _frame(table, instrument.detectors[2])["tails"]
    assert np.array_equal(tails.columns["residual_x_mpix"], table["residual_x_mpix"])
    assert tails.columns["id"].tolist() == [str(i) for i in table["source_id"].tolist()]
    assert ("source", "@{id}") in tails.hover


def test_subtitle_states_the_scale_in_pixels_and_mas(on_detector, instrument):
    frame = _frame(on_detector, instrument.detectors[2], arrow_scale=5000.0)
    assert "Arrows enlarged 5,000 times; key: 0.02 pix = 8.5 mas" in subtitle_of(frame)


def test_key_arrow_is_drawn_to_the_scale_of_the_arrows(on_detector, instrument):
    key = _frame(on_detector, instrument.detectors[2], arrow_scale=5000.0)["key"]
    assert key.values("x1")[0] - key.values("x0")[0] == pytest.approx(5000.0 * 0.02)


def test_axes_are_equal_in_pixels_and_cover_the_detector(on_detector, instrument):
    (plot,) = plots_of(plot_residual_map(on_detector, instrument.detectors[2]))
    x, y = plot.x_range, plot.y_range
    assert x.start < -960
    assert x.end > 960
    scale = plot.frame_width / (x.end - x.start)
    assert scale == pytest.approx(plot.frame_height / (y.end - y.start), rel=2e-3)
    assert "(pix)" in plot.below[0].axis_label
    assert "(pix)" in plot.left[0].axis_label


def test_whole_focal_plane_is_drawn_in_mm(fit_result, instrument):
    frame = _frame(tables.residual_map(fit_result, instrument, exposures=[(0, 0)]), instrument)
    assert frame.x.label == "focal-plane x (mm)"
    assert "µm = " in subtitle_of(frame)


def test_above_two_thousand_arrows_the_mean_of_each_bin_is_drawn(on_detector, instrument):
    table = pd.concat([on_detector] * 12, ignore_index=True)
    frame = _frame(table, instrument.detectors[2])
    assert len(table) > 2000
    assert 0 < len(frame["tails"]) <= 256
    assert f"{len(table):,} measurements: mean residual in" in subtitle_of(frame)
