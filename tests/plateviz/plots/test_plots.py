"""What holds for every plot: titles, units, themes, exact ids, hovers that find their column."""

import functools
import re
from dataclasses import replace

import holoviews as hv
import numpy as np
import pandas as pd
import pytest
from bokeh.models import ColumnDataSource, GlyphRenderer, HoverTool, Plot, Title

from plateviz import plots, tables
from plateviz.plots.style import CLASS_COLOURS
from plateviz.plots.theme import THEMES, theme_of
from tests.plateviz.plots.drawn_arrows import shafts_of

_LABELLED_UNIT = re.compile(
    r"\(.+\)|per bin|χ² / dof|expected scatter|iteration|in order|N$|σ of A$|"
    r"order of the distortion$"
)


@pytest.fixture(scope="module")
def drawings(fit_result, compared, make_fit_result, truth, instrument):
    """Return name -> (draw, table): the plot as a function of table and theme."""
    residuals = tables.residual_map(fit_result, instrument, detector_id=0)
    fields = tables.footprint_fields(fit_result, instrument)
    detector = instrument.detectors[0]
    return {
        "footprint": (
            lambda t, **o: plots.plot_footprint(t, fields.head(20 * len(t)), **o),
            tables.footprint_sources(fit_result),
        ),
        "residual_map": (lambda t, **o: plots.plot_residual_map(t, detector, **o), residuals),
        "residual_scatter": (plots.plot_residual_scatter, tables.residual_scatter(fit_result)),
        "deviation": (plots.plot_deviation, tables.deviation(fit_result, truth)),
        "uncertainty": (plots.plot_uncertainty, tables.uncertainty(fit_result, instrument)),
        "convergence": (plots.plot_convergence, tables.convergence(fit_result)),
        "distortion": (plots.plot_distortion, tables.distortion(fit_result, instrument)),
        "pulls": (plots.plot_pulls, tables.pull_histogram(fit_result)),
        "exposure_chi2": (plots.plot_exposure_chi2, tables.exposure_chi2(fit_result)),
        "orders": (plots.plot_orders, tables.order_comparison(compared)),
        "comparison": (
            plots.plot_comparison,
            tables.comparison(fit_result, make_fit_result(2)[0]),
        ),
        "mode_spectrum": (plots.plot_mode_spectrum, tables.mode_spectrum(fit_result)),
        "mode_deciders": (plots.plot_mode_deciders, tables.mode_deciders(fit_result)),
        "mode_groups": (plots.plot_mode_groups, tables.mode_groups(fit_result)),
        "mode_shifts": (plots.plot_mode_shifts, tables.mode_shifts(fit_result)),
        "prior_shares": (plots.plot_prior_shares, tables.prior_shares(fit_result)),
    }


NAMES = [
    "footprint",
    "residual_map",
    "residual_scatter",
    "deviation",
    "uncertainty",
    "convergence",
    "distortion",
    "pulls",
    "exposure_chi2",
    "orders",
    "comparison",
    "mode_spectrum",
    "mode_deciders",
    "mode_groups",
    "mode_shifts",
    "prior_shares",
]
with_every_plot = pytest.mark.parametrize("name", NAMES)


@pytest.fixture(scope="module")
def figures(drawings):
    """Return (name, theme) -> Bokeh figures of the plot; each is rendered once."""

    @functools.cache
    def rendered(name, theme):
        draw, table = drawings[name]
        return _figures(draw(table, theme=theme))

    return lambda name, theme="light": rendered(name, theme)


def _figures(drawing):
    return list(hv.render(drawing, backend="bokeh").select({"type": Plot}))


@with_every_plot
def test_axes_are_labelled_with_units(figures, name):
    for figure in figures(name):
        for axis in (figure.xaxis, figure.yaxis):
            assert _LABELLED_UNIT.search(axis.axis_label), axis.axis_label


@with_every_plot
def test_empty_table_gives_a_titled_figure_that_says_why(drawings, name):
    draw, table = drawings[name]
    for figure in _figures(draw(table.head(0))):
        assert figure.title.text
        assert figure.xaxis.axis_label
        words = [r.data_source.data["text"][0] for r in figure.renderers if _is_text(r)]
        assert len(words) == 1
        assert words[0].startswith("No ")


def _is_text(renderer):
    return isinstance(renderer, GlyphRenderer) and "text" in renderer.data_source.data


@with_every_plot
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_word_has_the_colours_of_the_theme(figures, name, theme):
    colours = THEMES[theme]
    for figure in figures(name, theme):
        assert figure.background_fill_color == figure.border_fill_color == colours.background
        titles = [figure.title, *(t for t in figure.above if isinstance(t, Title))]
        assert {t.text_color for t in titles} <= {colours.text, colours.muted}
        assert figure.xaxis.axis_label_text_color == colours.text
        assert all(legend.label_text_color == colours.text for legend in figure.legend)


@with_every_plot
def test_fonts_are_11_to_13_pixels(figures, name):
    for figure in figures(name):
        sizes = [figure.title.text_font_size, figure.xaxis.axis_label_text_font_size]
        sizes += [
            figure.yaxis.major_label_text_font_size,
            *(t.text_font_size for t in _texts(figure)),
        ]
        assert set(sizes) <= {"11px", "12px", "13px"}


def _texts(figure):
    return [title for title in figure.above if isinstance(title, Title)]


@with_every_plot
def test_no_figure_is_drawn_by_webgl(figures, name):
    """Which loses the points of a figure that replaces another on a page that stays."""
    assert {figure.output_backend for figure in figures(name)} == {"canvas"}


@with_every_plot
def test_no_legend_covers_the_data(figures, name):
    for figure in figures(name):
        assert all(legend in figure.below for legend in figure.legend if legend.items)


@with_every_plot
def test_every_hover_finds_its_columns(figures, name):
    for figure in figures(name):
        for hover in figure.select(HoverTool):
            wanted = {c for _, text in hover.tooltips for c in re.findall(r"@\{(\w+)\}", text)}
            assert wanted
            for renderer in hover.renderers:
                assert wanted <= set(renderer.data_source.data)


@with_every_plot
def test_ids_reach_the_browser_as_exact_text(figures, name, fit_result):
    known = {str(i) for i in fit_result.sources["source_id"].tolist()}
    for figure in figures(name):
        for source in figure.select(ColumnDataSource):
            assert set(source.data.get("id", [])) <= known
            assert "source_id" not in source.data


def test_live_update_replaces_the_subtitle(drawings):
    draw, table = drawings["residual_scatter"]
    rows = hv.streams.Stream.define("Rows", rows=50)()
    live = hv.DynamicMap(lambda rows: draw(table.head(rows)), streams=[rows])
    plot = hv.renderer("bokeh").get_plot(live)
    rows.event(rows=70)
    (subtitle,) = _texts(plot.state)
    assert subtitle.text.startswith("n = 70 ")


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("colour", CLASS_COLOURS.values(), ids=CLASS_COLOURS.keys())
def test_class_colours_stand_out_on_both_backgrounds(colour, theme):
    assert _contrast(colour, THEMES[theme].background) >= 3.0


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("part", ["text", "muted"])
def test_words_are_readable_on_both_backgrounds(part, theme):
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


def test_convergence_shows_the_loss_of_an_engine_that_has_one(fit_result):
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
