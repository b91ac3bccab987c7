"""Bokeh models of figures: what is drawn, and what changes when they follow other figures."""

import json
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from bokeh.core.property.descriptors import UnsetValueError
from bokeh.core.property.vectorization import Field, Value
from bokeh.document import Document
from bokeh.model import Model
from bokeh.models import AllLabels, CustomLabelingPolicy, HoverTool, LogScale, NoOverlap
from bokeh.util.warnings import BokehDeprecationWarning

from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import message
from plateviz.figures.glyphs import points
from plateviz.figures.theme import THEMES
from plateviz.figures.words import MENU


def renderers(drawn, number=0):
    return {one.name: one for one in drawn.frames[number].plot.renderers}


def models_of(drawn):
    """Return the ids of all models of the drawn figure."""
    return {model.id for model in drawn.model.references()}


@pytest.mark.parametrize("theme", list(THEMES))
def test_every_kind_is_drawn_in_order(every_kind, theme):
    drawn = BokehFigure(every_kind, theme)
    assert list(renderers(drawn)) == every_kind[0].names
    document = Document()
    document.add_root(drawn.model)
    document.validate()
    assert json.dumps(document.to_json(deferred=False))


def test_menu_of_the_tools_keeps_its_width_beside_a_wide_subtitle(every_kind):
    for one in BokehFigure(every_kind, "light").frames:
        assert one.plot.toolbar.styles["min-width"] == f"{MENU}px"


def test_unknown_theme_is_refused(every_kind):
    with pytest.raises(ValueError, match="expected one of light, dark, found 'blue'"):
        BokehFigure(every_kind, "blue")


def test_looks_depend_on_a_column(every_kind):
    glyph = renderers(BokehFigure(every_kind, "light"))["sources"].glyph
    assert glyph.fill_color.transform.palette == [THEMES["light"].mark, "#e4602a"]
    assert glyph.marker.transform.markers == ["circle", "x"]
    source = renderers(BokehFigure(every_kind, "light"))["sources"].data_source
    assert source.data[glyph.size.field].tolist() == [4.0, 7.0, 4.0]


def test_ids_are_exact_text(every_kind):
    source = renderers(BokehFigure(every_kind, "light"))["sources"].data_source
    assert source.data["id"].tolist()[1] == "4611686018427387904"


def test_hover_is_limited_to_its_glyphs(every_kind):
    drawn = BokehFigure(every_kind, "light")
    (hover,) = [tool for tool in drawn.frames[0].plot.tools if isinstance(tool, HoverTool)]
    assert hover.renderers == [renderers(drawn)["sources"]]
    assert hover.tooltips == [("source", "@{id}")]


def test_legend_has_an_item_per_label(every_kind):
    legend = BokehFigure(every_kind, "light").frames[0].plot.legend[0]
    labels = [Value("expected"), Value("law"), Field("kind")]
    assert [item.label for item in legend.items] == labels
    assert legend.visible
    assert not BokehFigure(every_kind, "light").frames[1].plot.legend[0].visible


def test_frames_are_linked_as_asked(every_kind):
    first, second = (frame.plot for frame in BokehFigure(every_kind, "light").frames)
    assert first.x_range is second.x_range
    assert first.y_range is not second.y_range


def test_frames_of_a_row_have_subtitles_of_equal_height(every_kind):
    for frame in BokehFigure(every_kind, "light").frames:
        (subtitle,) = [one for one in frame.plot.above if one is not frame.plot.title]
        assert subtitle.text.count("\n") == 1


def test_logarithmic_axes(framed_glyphs, marks):
    figure = framed_glyphs([marks()], x=(1.0, 10.0), is_log=True)
    assert isinstance(BokehFigure(figure, "light").frames[0].plot.x_scale, LogScale)


def test_following_keeps_the_models_and_sends_what_differs(framed_glyphs, marks):
    drawn = BokehFigure(framed_glyphs([marks()], legend_columns=1), "light")
    document, events = Document(), []
    document.add_root(drawn.model)
    before = models_of(drawn)
    document.on_change(events.append)
    drawn.follow(framed_glyphs([marks()], legend_columns=1), "light")
    assert not events
    drawn.follow(framed_glyphs([marks(2)], title="Two", x=(0.0, 3.0), legend_columns=1), "light")
    assert models_of(drawn) == before
    assert {event.attr for event in events} <= {
        "data",
        "text",
        "start",
        "end",
        "reset_start",
        "reset_end",
        "frame_height",
        "desired_num_ticks",
    }
    (frame,) = drawn.frames
    assert frame.plot.title.text == "Two"
    assert (frame.plot.x_range.start, frame.plot.x_range.end) == (0.0, 3.0)
    assert renderers(drawn)["sources"].data_source.data["id"].tolist() == [
        "7",
        "4611686018427387904",
    ]


def test_only_columns_that_differ_are_sent(framed_glyphs, marks):
    table = {
        "x": np.array([1.0, np.nan]),
        "y": np.array([1.0, 2.0]),
        "id": np.array(["1", "2"], dtype=object),
    }

    def figure(**others):
        return framed_glyphs(
            [points(table | others, "x", "y", name="p", color="mark", keep=["id"])]
        )

    drawn = BokehFigure(figure(), "light")
    document, events = Document(), []
    document.add_root(drawn.model)
    document.on_change(events.append)
    for name, values in (("y", [1.0, 2.5]), ("id", ["1", "3"]), ("x", [np.nan, 1.0])):
        kind = object if name == "id" else float
        table[name] = np.array(values, dtype=kind)
        drawn.follow(figure(), "light")
        assert [set(event.cols) for event in events] == [{name}]
        assert renderers(drawn)["p"].data_source.data[name] is table[name]
        events.clear()
    longer = {name: np.concatenate([values, values]) for name, values in table.items()}
    drawn.follow(figure(**longer), "light")
    (event,) = events
    assert event.cols is None
    assert renderers(drawn)["p"].data_source.data["y"].tolist() == [1.0, 2.5] * 2


def values_of(part, seen):
    """Return all properties of a model and of those it refers to, without their ids."""
    if isinstance(part, Model):
        if part.id in seen:
            return seen[part.id]
        seen[part.id] = f"{type(part).__name__} {len(seen)}"
        return {name: values_of(value, seen) for name, value in properties_of(part)}
    if isinstance(part, dict):
        return {key: values_of(value, seen) for key, value in part.items()}
    if isinstance(part, list | tuple | np.ndarray):
        return [values_of(value, seen) for value in part]
    if isinstance(part, Field):
        return [part.field, values_of(part.transform, seen)]
    return repr(float(part)) if isinstance(part, int) else repr(part)


def properties_of(model):
    """Yield name and value of every property that has a value, but for those of callbacks."""
    for name in sorted(model.properties() - {"js_property_callbacks"}):
        with suppress(UnsetValueError, BokehDeprecationWarning):
            yield name, getattr(model, name)


def test_followed_figure_is_the_one_that_is_drawn_anew(every_kind, framed_glyphs, marks):
    first, second = every_kind.frames
    other = replace(
        first,
        title="Other",
        subtitle="",
        x=replace(first.x, label="other (mm)", limits=(9.0, -9.0), ticks=[(1.0, "one")]),
        legend_columns=0,
    )
    drawn = BokehFigure(replace(every_kind, frames=(other, second)), "light")
    drawn.follow(every_kind, "dark")
    assert values_of(drawn.model, {}) == values_of(BokehFigure(every_kind, "dark").model, {})


def test_theme_changes_in_place(every_kind):
    drawn = BokehFigure(every_kind, "light")
    before = models_of(drawn)
    drawn.follow(every_kind, "dark")
    assert models_of(drawn) == before
    plot = drawn.frames[0].plot
    assert plot.background_fill_color == THEMES["dark"].background
    assert renderers(drawn)["law"].glyph.line_color == THEMES["dark"].text


def test_glyphs_that_are_gone_are_hidden_and_come_back(framed_glyphs, marks):
    drawn = BokehFigure(framed_glyphs([marks(), marks(name="others")]), "light")
    drawn.follow(framed_glyphs([marks(name="others")]), "light")
    assert [name for name, one in renderers(drawn).items() if one.visible] == ["others"]
    drawn.follow(framed_glyphs([marks(), marks(name="others")]), "light")
    assert all(one.visible for one in renderers(drawn).values())
    assert list(renderers(drawn)) == ["sources", "others"]


def test_another_number_of_frames_is_drawn_anew(every_kind):
    drawn = BokehFigure(every_kind, "light")
    drawn.follow(message("Title", "No sources"), "light")
    assert len(drawn.model.children) == 1
    assert [n for n, one in renderers(drawn).items() if one.visible] == ["message"]
    drawn.follow(every_kind, "light")
    assert len(drawn.model.children) == 2
    assert "message" not in renderers(drawn)


def test_glyphs_that_need_other_models_are_drawn_anew(framed_glyphs, marks):
    silent = framed_glyphs([replace(marks(), hover=())])
    drawn = BokehFigure(silent, "light")
    drawn.follow(framed_glyphs([marks()]), "light")
    assert [t.renderers for t in drawn.frames[0].plot.tools if isinstance(t, HoverTool)] == [
        [renderers(drawn)["sources"]]
    ]


def test_other_kinds_of_axes_are_drawn_anew(framed_glyphs, marks):
    drawn = BokehFigure(framed_glyphs([marks()]), "light")
    drawn.follow(framed_glyphs([marks()], x=(1.0, 10.0), is_log=True), "light")
    assert isinstance(drawn.frames[0].plot.x_scale, LogScale)
    assert drawn.model.children[0][0] is drawn.frames[0].plot


def test_labels_of_ticks_may_not_overlap_unless_they_are_turned(framed_glyphs, marks):
    figure = framed_glyphs([marks()])
    turned = replace(figure[0], x=replace(figure[0].x, rotation=30.0))
    drawn = BokehFigure(figure, "light")
    (lower,), (left,) = drawn.frames[0].plot.below[:1], drawn.frames[0].plot.left
    assert isinstance(lower.major_label_policy, CustomLabelingPolicy)
    before = lower.major_label_policy
    drawn.follow(figure, "dark")
    assert lower.major_label_policy is before
    drawn.follow(replace(figure, frames=(turned,)), "light")
    assert isinstance(lower.major_label_policy, AllLabels)
    assert isinstance(left.major_label_policy, CustomLabelingPolicy)
    named = replace(figure[0], x=replace(figure[0].x, ticks=[(1.0, "one")]))
    drawn.follow(replace(figure, frames=(named,)), "light")
    assert isinstance(lower.major_label_policy, NoOverlap)
