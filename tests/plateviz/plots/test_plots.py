"""Contents of the plots of an orbit."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz import plots, tables
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.theme import THEMES, theme_of
from plateviz.plots.elements.style import CLASS_COLOURS
from tests.plateviz.plots.drawn import contrast, plots_of, renderers_of, shafts_of


def test_drawn_figure_follows_another_table_in_place(drawings):
    draw, table = drawings["residual_scatter"]
    drawn = BokehFigure(draw(table.head(70)), "light")
    (plot,) = (frame.plot for frame in drawn.frames)
    measurements = renderers_of(plot)[0]
    drawn.follow(draw(table.head(50)), "dark")
    assert [frame.plot for frame in drawn.frames] == [plot]
    assert drawn.model.children == [(plot, 0, 0)]
    assert renderers_of(plot)[0] is measurements
    shown = measurements.data_source.data
    assert list(shown["id"]) == table["id"].head(50).tolist()
    assert np.array_equal(shown["residual_x_mpix"], table["residual_x_mpix"].head(50))
    (subtitle,) = plot.above
    assert subtitle.text.startswith("n = 50 ")
    assert plot.background_fill_color == THEMES["dark"].background


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("colour", CLASS_COLOURS.values(), ids=CLASS_COLOURS.keys())
def test_class_colours_stand_out_on_both_backgrounds(colour, theme):
    assert contrast(colour, THEMES[theme].background) >= 3.0


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("part", ["text", "muted"])
def test_text_is_readable_on_both_backgrounds(part, theme):
    assert contrast(getattr(THEMES[theme], part), THEMES[theme].background) >= 4.5


def test_unknown_theme_is_refused():
    with pytest.raises(ValueError, match="expected one of light, dark"):
        theme_of("sepia")


def test_footprint_has_east_to_the_left_and_equal_aspect(drawings):
    draw, table = drawings["footprint"]
    (plot,) = plots_of(draw(table))
    assert plot.x_range.start > plot.x_range.end
    scale = plot.frame_width / abs(plot.x_range.end - plot.x_range.start)
    height = plot.frame_height / (plot.y_range.end - plot.y_range.start)
    assert scale == pytest.approx(height, rel=5e-3)


def test_footprint_rows_keep_the_order_of_the_table(drawings):
    draw, table = drawings["footprint"]
    assert draw(table)[0]["sources"].columns["id"].tolist() == table["id"].tolist()


def test_footprint_outlines_and_names_every_field(drawings, instrument):
    draw, table = drawings["footprint"]
    (frame,) = draw(table)
    dashes, counts = np.unique(frame["outlines"].columns["dash"].astype(str), return_counts=True)
    assert len(dashes) == 4
    assert set(counts) == {len(instrument.detectors)}
    assert set(frame["field numbers"].values("text")) == {"0", "1", "2", "3"}


def test_distortion_arrows_are_drawn_to_the_stated_scale(drawings):
    draw, table = drawings["distortion"]
    (frame,) = draw(table, arrow_scale=500.0)
    shafts = shafts_of(frame)
    drawn = np.hypot(shafts["x1"] - shafts["x0"], shafts["y1"] - shafts["y0"])
    assert np.allclose(drawn, 0.5 * np.hypot(table["dx_um"], table["dy_um"]))


def test_comparison_arrows_are_drawn_to_the_stated_scale(drawings):
    _, table = drawings["comparison"]
    (frame,) = plots.plot_comparison_map(table, arrow_scale=60_000.0)
    shafts = shafts_of(frame)
    assert np.allclose(shafts["x1"] - shafts["x0"], 60_000.0 * table["u_arcmin"])
    assert np.allclose(shafts["y1"] - shafts["y0"], 60_000.0 * table["v_arcmin"])
    of_sources = np.hypot(table["difference_ra_mas"], table["difference_dec_mas"])
    assert np.allclose(
        60_000.0 * np.hypot(table["u_arcmin"], table["v_arcmin"]), of_sources, rtol=1e-3
    )


def test_convergence_shows_the_tolerance(drawings):
    draw, table = drawings["convergence"]
    line = draw(table)[0]["tolerance"]
    assert line.kind == "horizontal"
    assert line.values("y").tolist() == [table["tolerance"].iloc[0]]


def test_convergence_shows_the_loss_of_svi(fit_result):
    loss = 1e6 * np.exp(-np.arange(300) / 20.0) - 500.0
    steps = pd.DataFrame({"step": np.arange(1, 301), "loss": loss})
    svi = replace(fit_result, losses=steps)
    _, frame = plots.plot_convergence(tables.convergence(svi), tables.loss_excess(svi))
    excess = frame["loss"].values("y")
    assert excess[0] == pytest.approx(1e6, rel=1e-3)
    assert (np.diff(excess) < 0).all()
    # The hover shows the loss itself.
    assert np.array_equal(frame["loss"].columns["loss"], loss[: len(excess)])


def test_pulls_are_drawn_against_a_unit_normal_of_the_same_area(drawings):
    draw, table = drawings["pulls"]
    normal = draw(table)[0]["unit normal"]
    area = np.trapezoid(normal.values("y"), normal.values("x"))
    bins = table[table["axis"] == "x"]
    assert area == pytest.approx((bins["count"] * (bins["right"] - bins["left"])).sum(), rel=1e-3)
