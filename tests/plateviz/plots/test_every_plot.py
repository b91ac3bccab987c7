"""Properties of every plot: titles, units, themes, exact ids, columns of the hovers."""

import re
from pathlib import Path

import numpy as np
import pytest
from bokeh.core.serialization import Serializer
from bokeh.core.validation import check_integrity
from bokeh.document import Document
from bokeh.models import BoxZoomTool, ColorBar, Text, Title

from plateviz import plots
from plateviz.dashboard.saving.downloads import as_file
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import MESSAGE, Figure
from plateviz.figures.figure_tables import figure_tables
from plateviz.figures.resized import resized
from plateviz.figures.theme import THEMES
from solver.io.formats import read_tables
from tests.plateviz.plots.drawn import renderers_of, texts_of

_LABELLED_UNIT = re.compile(
    r"\(.+\)|per bin|χ² / dof|expected scatter|iteration|in order|N$|σ of A$|"
    r"order of the distortion$|over its expected σ|/ σ$|orbits N|dof\)$"
)


def plot_names(*, survey_only=False):
    """Return the <noun> of every `plot_<noun>` that a module of `plateviz.plots` defines.

    `survey_only`: only of modules that define figures of a survey or of one source.
    """
    names = []
    for path in sorted(Path(plots.__file__).parent.rglob("*.py")):
        text = path.read_text("utf-8")
        if not survey_only or re.search(r"^(SURVEY|SOURCE)_FIGURES\b", text, re.MULTILINE):
            names += re.findall(r"^def plot_(\w+)", text, re.MULTILINE)
    return names


with_every_plot = pytest.mark.parametrize("name", plot_names())
with_every_survey_plot = pytest.mark.parametrize("name", plot_names(survey_only=True))
_ON_BARS = "#ffffff"
in_both_themes = pytest.mark.parametrize("theme", THEMES)


def test_every_plot_is_exported():
    assert set(plots.__all__) == {f"plot_{name}" for name in plot_names()}
    assert all(callable(getattr(plots, name)) for name in plots.__all__)


def test_every_plot_has_a_table_to_draw(drawings):
    assert set(drawings) == set(plot_names())


@with_every_plot
def test_every_colour_is_one_of_the_theme_or_a_value(figures, name):
    """The browser draws nothing in a colour that it does not know."""
    for frame in figures(name):
        for glyphs in frame.glyphs:
            colours = [look for key, look in glyphs.looks.items() if key.endswith("color")]
            words = [one for one in colours if isinstance(one, str) and one[0] not in "#@"]
            assert {"background", "text", "muted", "grid", "line", "mark"} >= set(words)


@with_every_plot
def test_axes_are_labelled_with_units(figures, name):
    for frame in figures(name):
        for axis in (frame.x, frame.y):
            assert _LABELLED_UNIT.search(axis.label), axis.label


@with_every_plot
def test_glyphs_of_a_frame_have_different_names(figures, name):
    for frame in figures(name):
        assert len(set(frame.names)) == len(frame.names)
        assert all(frame.names)


@with_every_plot
def test_data_of_every_figure_can_be_saved_as_fits(figures, name, tmp_path):
    # In a narrow card, the labels of axes have several lines.
    tables = figure_tables(resized(Figure(tuple(figures(name))), 400, 300))
    made = as_file(tables, name, ".fits")
    (tmp_path / made.name).write_bytes(made.content)
    read = read_tables(tmp_path / made.name)
    assert [table.upper() for table in read] == [table.upper() for table in tables]


@with_every_survey_plot
def test_every_figure_of_a_survey_has_a_title_and_a_subtitle(figures, name):
    for frame in figures(name):
        assert frame.title
        assert frame.subtitle


@with_every_plot
def test_empty_table_gives_a_titled_figure_with_a_reason(drawings, name):
    draw, table = drawings[name]
    figure = draw(table.head(0))
    assert figure.message.startswith("No ")
    for frame in figure:
        (text,) = texts_of(frame)
        assert frame.title
        assert frame.x.label
        assert text.startswith("No ")
    for drawn in BokehFigure(figure, "light").frames:
        assert [one.name for one in renderers_of(drawn.plot)] == [MESSAGE]


@with_every_plot
@in_both_themes
def test_text_has_the_colours_of_the_theme(drawn_figures, name, theme):
    colours = THEMES[theme]
    for plot in _plots(drawn_figures(name, theme)):
        assert plot.background_fill_color == plot.border_fill_color == colours.background
        titles = [plot.title, *plot.above]
        assert {t.text_color for t in titles} <= {colours.text, colours.muted}
        for axis in plot.axis:
            assert axis.axis_label_text_color == colours.text
            assert axis.major_label_text_color == colours.muted
        assert all(legend.label_text_color == colours.text for legend in plot.legend)
        for bar in _bars(plot):
            assert bar.title_text_color == colours.text
            assert bar.major_label_text_color == colours.muted
        inside = {text.text_color["value"] for text in _texts(plot)}
        assert inside <= {colours.text, colours.muted, _ON_BARS}


@with_every_plot
@in_both_themes
def test_fonts_are_11_to_13_pixels(drawn_figures, name, theme):
    for plot in _plots(drawn_figures(name, theme)):
        sizes = [title.text_font_size for title in (plot.title, *plot.above)]
        for axis in plot.axis:
            sizes += [axis.axis_label_text_font_size, axis.major_label_text_font_size]
        sizes += [legend.label_text_font_size for legend in plot.legend]
        sizes += [bar.title_text_font_size for bar in _bars(plot)]
        sizes += [bar.major_label_text_font_size for bar in _bars(plot)]
        assert set(sizes) <= {"11px", "12px", "13px"}
        inside = {text.text_font_size["value"] for text in _texts(plot)}
        assert inside <= {"10px", "11px", "12px", "13px"}


@with_every_plot
def test_the_subtitle_is_below_the_title(drawn_figures, drawings, name):
    draw, table = drawings[name]
    for frame, plot in zip(draw(table), _plots(drawn_figures(name, "light")), strict=True):
        assert plot.title.text.replace("\u200b", "").split() == frame.title.split()
        assert plot.title_location == "above"
        (subtitle,) = (title for title in plot.above if isinstance(title, Title))
        assert subtitle.text.replace("\u200b", "").split() == frame.subtitle.split()
        assert subtitle.visible == bool(subtitle.text)


@with_every_plot
def test_no_figure_is_drawn_by_webgl(drawn_figures, name):
    """WebGL loses the points of a figure that replaces another on an open page."""
    plots = _plots(drawn_figures(name, "light"))
    assert {plot.output_backend for plot in plots} == {"canvas"}


@with_every_plot
def test_no_legend_covers_the_data(drawn_figures, drawings, name):
    draw, table = drawings[name]
    for frame, plot in zip(draw(table), _plots(drawn_figures(name, "light")), strict=True):
        assert all(legend in plot.below for legend in plot.legend)
        wanted = {one.label for one in frame.glyphs if one.label and len(one)}
        (legend,) = plot.legend
        assert legend.visible == bool(legend.items)
        assert len(legend.items) == (len(wanted) if frame.legend_columns else 0)


@with_every_plot
def test_axes_of_one_scale_have_it_on_the_screen(drawn_figures, drawings, name):
    draw, table = drawings[name]
    for frame, plot in zip(draw(table), _plots(drawn_figures(name, "light")), strict=True):
        (zoom,) = (tool for tool in plot.tools if isinstance(tool, BoxZoomTool))
        assert zoom.match_aspect == (frame.height is None)
        if frame.height is None:
            x, y = (abs(limits.end - limits.start) for limits in (plot.x_range, plot.y_range))
            assert x / plot.frame_width == pytest.approx(y / plot.frame_height, rel=5e-3)


@with_every_plot
def test_every_hover_finds_its_columns(drawn_figures, drawings, name):
    draw, table = drawings[name]
    for frame, plot in zip(draw(table), _plots(drawn_figures(name, "light")), strict=True):
        found = set()
        for hover in plot.hover:
            wanted = {c for _, text in hover.tooltips for c in re.findall(r"@\{(\w+)\}", text)}
            assert wanted
            for renderer in hover.renderers:
                found.add(renderer.name)
                assert wanted <= set(renderer.data_source.data)
        assert found == {one.name for one in frame.glyphs if one.hover}


@with_every_plot
@in_both_themes
def test_ids_reach_the_browser_as_exact_text(drawn_figures, name, theme, fit_result, survey):
    measured, known = fit_result.sources["source_id"], survey.catalogue["source_id"]
    ids = {str(i) for i in [*measured.tolist(), *known.tolist()]}
    for plot in _plots(drawn_figures(name, theme)):
        for renderer in plot.renderers:
            assert set(renderer.data_source.data.get("id", [])) <= ids
            assert "source_id" not in renderer.data_source.data


@with_every_plot
@in_both_themes
def test_bokeh_accepts_every_drawn_figure(drawn_figures, name, theme):
    document = Document()
    document.add_root(drawn_figures(name, theme).model)
    issues = check_integrity(document.models)
    assert [issue.code for issue in issues.error] == []
    assert document.to_json()
    document.clear()


@with_every_plot
@pytest.mark.parametrize("rows", [None, 0], ids=["same table", "empty table"])
def test_a_figure_that_follows_another_shows_what_a_new_one_does(
    drawn_figures, drawings, name, rows
):
    draw, table = drawings[name]
    first = draw(table.head(len(table) if rows is None else rows))
    followed = BokehFigure(first, "light")
    followed.follow(draw(table), "dark")
    plots = [child for child, _, _ in followed.model.children]
    for plot, new in zip(plots, _plots(drawn_figures(name, "dark")), strict=True):
        assert _shown(plot) == _shown(new)


@with_every_survey_plot
def test_drawing_a_table_twice_gives_equal_figures(drawings, name):
    draw, table = drawings[name]
    first, second = (
        [
            [str(values) for values in one.columns.values()]
            for frame in draw(table)
            for one in frame.glyphs
        ]
        for _ in range(2)
    )
    assert first == second


def _plots(drawn):
    return [frame.plot for frame in drawn.frames]


def _bars(plot):
    return [bar for bar in plot.right if isinstance(bar, ColorBar)]


def _texts(plot):
    return [one.glyph for one in renderers_of(plot) if isinstance(one.glyph, Text)]


def _shown(plot):
    """Return its words, limits, colours and values, as what can be compared."""
    words = [plot.title.text, *(title.text for title in plot.above if title.visible)]
    words += [axis.axis_label for axis in plot.axis]
    limits = [(one.start, one.end) for one in (plot.x_range, plot.y_range)]
    glyphs = [(one.name, _columns(one), _looks(one.glyph)) for one in renderers_of(plot)]
    labels = [(item.label, [one.name for one in item.renderers]) for item in plot.legend[0].items]
    return str((words, limits, plot.frame_width, plot.frame_height, glyphs, labels))


def _columns(renderer):
    return {name: np.asarray(v).tolist() for name, v in renderer.data_source.data.items()}


def _looks(glyph):
    """Return its properties without the numbers of models."""
    content = Serializer().serialize(glyph).content
    return re.sub(r"'id': '\w+'", "", str(content))
