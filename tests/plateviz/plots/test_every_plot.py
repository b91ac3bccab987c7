"""Properties of every plot: titles, units, themes, exact ids, columns of the hovers."""

import re
from pathlib import Path

import pytest
from bokeh.models import ColumnDataSource, HoverTool

from plateviz import plots
from plateviz.plots.theme import THEMES
from tests.plateviz.plots.drawn import figures_of, sources_of, subtitle_of, texts_of, titles_of

_LABELLED_UNIT = re.compile(
    r"\(.+\)|per bin|χ² / dof|expected scatter|iteration|in order|N$|σ of A$|"
    r"order of the distortion$|over its expected σ|/ σ$|orbits N|dof\)$"
)


def plot_names(*, survey_only=False):
    """Return the <noun> of every `plot_<noun>` that a module of `plateviz.plots` defines.

    `survey_only`: only of modules that define figures of a survey or of one source.
    """
    names = []
    for path in sorted(Path(plots.__file__).parent.glob("*.py")):
        text = path.read_text("utf-8")
        if not survey_only or re.search(r"^(SURVEY|SOURCE)_FIGURES\b", text, re.MULTILINE):
            names += re.findall(r"^def plot_(\w+)", text, re.MULTILINE)
    return names


with_every_plot = pytest.mark.parametrize("name", plot_names())
with_every_survey_plot = pytest.mark.parametrize("name", plot_names(survey_only=True))


def test_every_plot_is_exported():
    assert set(plots.__all__) == {f"plot_{name}" for name in plot_names()}
    assert all(callable(getattr(plots, name)) for name in plots.__all__)


def test_every_plot_has_a_table_to_draw(drawings):
    assert set(drawings) == set(plot_names())


@with_every_plot
def test_axes_are_labelled_with_units(figures, name):
    for figure in figures(name):
        for axis in (figure.xaxis, figure.yaxis):
            assert _LABELLED_UNIT.search(axis.axis_label), axis.axis_label


@with_every_survey_plot
def test_every_figure_of_a_survey_has_a_title_and_a_subtitle(figures, name):
    for figure in figures(name):
        assert figure.title.text
        assert subtitle_of(figure)


@with_every_plot
def test_empty_table_gives_a_titled_figure_with_a_reason(drawings, name):
    draw, table = drawings[name]
    for figure in figures_of(draw(table.head(0))):
        (text,) = texts_of(figure)
        assert figure.title.text
        assert figure.xaxis.axis_label
        assert text.startswith("No ")


@with_every_plot
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_has_the_colours_of_the_theme(figures, name, theme):
    colours = THEMES[theme]
    for figure in figures(name, theme):
        assert figure.background_fill_color == figure.border_fill_color == colours.background
        titles = [figure.title, *titles_of(figure)]
        assert {t.text_color for t in titles} <= {colours.text, colours.muted}
        assert figure.xaxis.axis_label_text_color == colours.text
        assert all(legend.label_text_color == colours.text for legend in figure.legend)


@with_every_plot
def test_fonts_are_11_to_13_pixels(figures, name):
    for figure in figures(name):
        sizes = [figure.title.text_font_size, figure.xaxis.axis_label_text_font_size]
        sizes += [
            figure.yaxis.major_label_text_font_size,
            *(title.text_font_size for title in titles_of(figure)),
        ]
        assert set(sizes) <= {"11px", "12px", "13px"}


@with_every_plot
def test_no_figure_is_drawn_by_webgl(figures, name):
    """WebGL loses the points of a figure that replaces another on an open page."""
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
def test_ids_reach_the_browser_as_exact_text(figures, name, fit_result, survey):
    measured, known = fit_result.sources["source_id"], survey.catalogue["source_id"]
    ids = {str(i) for i in [*measured.tolist(), *known.tolist()]}
    for figure in figures(name):
        for source in figure.select(ColumnDataSource):
            assert set(source.data.get("id", [])) <= ids
            assert "source_id" not in source.data


@with_every_survey_plot
def test_drawing_a_table_twice_gives_equal_figures(drawings, name):
    draw, table = drawings[name]
    first, second = (
        [str(s.data) for f in figures_of(draw(table)) for s in sources_of(f)] for _ in range(2)
    )
    assert first == second
