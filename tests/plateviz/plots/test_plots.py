"""Contents of the plots of an orbit."""

from dataclasses import replace

import holoviews as hv
import numpy as np
import pandas as pd
import pytest

from plateviz import plots, tables
from plateviz.plots.style import CLASS_COLOURS
from plateviz.plots.theme import THEMES, theme_of
from tests.plateviz.plots.drawn import shafts_of, titles_of


def test_live_update_replaces_the_subtitle(drawings):
    draw, table = drawings["residual_scatter"]
    rows = hv.streams.Stream.define("Rows", rows=50)()
    live = hv.DynamicMap(lambda rows: draw(table.head(rows)), streams=[rows])
    plot = hv.renderer("bokeh").get_plot(live)
    rows.event(rows=70)
    (subtitle,) = titles_of(plot.state)
    assert subtitle.text.startswith("n = 70 ")


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("colour", CLASS_COLOURS.values(), ids=CLASS_COLOURS.keys())
def test_class_colours_stand_out_on_both_backgrounds(colour, theme):
    assert _contrast(colour, THEMES[theme].background) >= 3.0


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("part", ["text", "muted"])
def test_text_is_readable_on_both_backgrounds(part, theme):
    assert _contrast(getattr(THEMES[theme], part), THEMES[theme].background) >= 4.5


def _contrast(one, other):
    """Return the contrast ratio of WCAG 2."""
    levels = []
    for colour in (one, other):
        rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        levels.append(float(linear @ (0.2126, 0.7152, 0.0722)))
    return (max(levels) + 0.05) / (min(levels) + 0.05)


def test_unknown_theme_is_refused():
    with pytest.raises(ValueError, match="expected one of light, dark"):
        theme_of("sepia")


def test_footprint_has_east_to_the_left_and_equal_aspect(figures):
    (figure,) = figures("footprint")
    assert figure.x_range.start > figure.x_range.end
    scale = figure.frame_width / abs(figure.x_range.end - figure.x_range.start)
    height = figure.frame_height / (figure.y_range.end - figure.y_range.start)
    assert scale == pytest.approx(height, rel=5e-3)


def test_footprint_rows_keep_the_order_of_the_table(drawings):
    draw, table = drawings["footprint"]
    points = next(e for e in draw(table) if isinstance(e, hv.Points))
    assert points.dimension_values("id", expanded=True).tolist() == table["id"].tolist()


def test_footprint_outlines_and_names_every_field(drawings):
    draw, table = drawings["footprint"]
    overlay = draw(table)
    assert sum(isinstance(element, hv.Path) for element in overlay) == 4
    names = {e.data[2] for e in overlay if isinstance(e, hv.Text)}
    assert names == {f"field {k}" for k in range(4)}


def test_distortion_arrows_are_drawn_to_the_stated_scale(drawings):
    draw, table = drawings["distortion"]
    shafts = shafts_of(draw(table, arrow_scale=500.0))
    drawn = np.hypot(shafts["x_end"] - shafts["x"], shafts["y_end"] - shafts["y"])
    assert np.allclose(drawn, 0.5 * np.hypot(table["dx_um"], table["dy_um"]))


def test_comparison_arrows_are_drawn_to_the_stated_scale(drawings):
    _, table = drawings["comparison"]
    overlay = plots.plot_comparison_map(table, arrow_scale=60_000.0)
    shafts = shafts_of(overlay)
    assert np.allclose(shafts["x_end"] - shafts["x"], table["difference_ra_mas"])
    assert np.allclose(shafts["y_end"] - shafts["y"], table["difference_dec_mas"])


def test_convergence_shows_the_tolerance(drawings):
    draw, table = drawings["convergence"]
    steps = next(iter(draw(table)))
    line = next(e for e in steps if isinstance(e, hv.HLine))
    assert line.data == table["tolerance"].iloc[0]


def test_convergence_shows_the_loss_of_svi(fit_result):
    loss = 1e6 * np.exp(-np.arange(300) / 20.0) - 500.0
    steps = pd.DataFrame({"step": np.arange(1, 301), "loss": loss})
    svi = replace(fit_result, losses=steps)
    _, drawn = plots.plot_convergence(tables.convergence(svi), tables.loss_excess(svi))
    curve = next(e for e in drawn if isinstance(e, hv.Curve)).dframe()
    assert curve["excess"].iloc[0] == pytest.approx(1e6, rel=1e-3)
    assert (np.diff(curve["excess"]) < 0).all()


def test_pulls_are_drawn_against_a_unit_normal_of_the_same_area(drawings):
    draw, table = drawings["pulls"]
    normal = next(e for e in draw(table) if e.label == "unit normal").dframe()
    area = np.trapezoid(normal["count"], normal["x"])
    bins = table[table["axis"] == "x"]
    assert area == pytest.approx((bins["count"] * (bins["right"] - bins["left"])).sum(), rel=1e-3)
