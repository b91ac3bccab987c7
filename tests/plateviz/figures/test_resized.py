"""A figure in another size."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.figures.figure import MARGIN, Axis, Figure, Ramp, framed, side_by_side
from plateviz.figures.glyphs import line, points
from plateviz.figures.resized import resized
from plateviz.figures.text_width import text_width
from plateviz.figures.theme import SMALL_SIZE
from plateviz.figures.words import words_of, words_of_row

X = Axis("x (mm)", (0.0, 10.0))
TABLE = {"x": [1.0], "y": [1.0], "n": [3.0]}


def frame(*, height=100, y=(0.0, 5.0), glyphs=(), **words):
    marks = [points(TABLE, "x", "y", name="marks", color="mark"), *glyphs]
    return framed(marks, title="Marks", x=X, y=Axis("y (mm)", y), width=200, height=height, **words)


def sizes(figure):
    return [(one.width, one.frame_height) for one in figure]


def test_frame_fills_the_area_around_its_axes_and_words():
    ((width, height),) = sizes(resized(frame(), 800, 400))
    assert 640 < width < 800
    assert 260 < height < 400


def test_equal_scales_of_both_axes_are_kept():
    for area in ((900, 300), (300, 900)):
        ((width, height),) = sizes(resized(frame(height=None), *area))
        assert width == pytest.approx(2 * height, abs=1)
        assert width < area[0]
        assert height < area[1]


def test_only_sizes_and_columns_differ():
    before = frame()
    after = resized(before, 800, 400)
    assert replace(after[0], width=200, height=100).glyphs == before[0].glyphs
    assert (after[0].x, after[0].title) == (before[0].x, before[0].title)


@pytest.mark.parametrize(
    "words",
    [
        {"subtitle": "two lines\nof words"},
        {"glyphs": [line([0, 1], [0, 1], name="l", color="mark", label="a line")]},
    ],
)
def test_words_and_legend_take_height(words):
    more = frame(**words, legend_columns=1)
    assert sizes(resized(more, 800, 400))[0][1] < sizes(resized(frame(), 800, 400))[0][1]


def test_legend_has_as_many_columns_as_fit():
    names = np.array(["a class of sources", "another class of sources"], dtype=object)
    table = {"x": [1.0, 2.0], "y": [1.0, 2.0], "kind": names}
    kinds = points(table, "x", "y", name="kinds", color="mark", label="@kind")
    wide, narrow = (resized(frame(glyphs=[kinds], legend_columns=9), w, 400) for w in (800, 300))
    assert [wide[0].legend_columns, narrow[0].legend_columns] == [2, 1]
    assert sizes(narrow)[0][1] < sizes(wide)[0][1]


def test_legend_that_would_be_cut_off_is_left_out():
    label = "measured = predicted, along a line"
    named = line([0, 1], [0, 1], name="l", color="mark", label=label)
    wide, narrow = (resized(frame(glyphs=[named], legend_columns=1), w, 400) for w in (800, 200))
    assert [wide[0].legend_columns, narrow[0].legend_columns] == [1, 0]


def test_words_are_left_out_where_they_would_take_most_of_the_height():
    wordy = frame(subtitle="word " * 200)
    small, large = resized(wordy, 300, 300), resized(wordy, 1500, 900)
    assert small[0].subtitle == ""
    assert large[0].subtitle == wordy[0].subtitle


def test_last_lines_of_a_subtitle_give_way_first():
    lines = [f"line {number}" for number in range(9)]
    wordy = frame(subtitle="\n".join(lines))
    shown = [resized(wordy, 300, height)[0].subtitle.split("\n") for height in (500, 270, 240)]
    assert lines == shown[0]
    assert lines[: len(shown[1])] == shown[1]
    assert lines[: len(shown[2])] == shown[2]
    assert len(shown[0]) > len(shown[1]) > len(shown[2]) > 0


def test_words_are_shown_wherever_they_take_no_height():
    row = Figure(frame(height=None, subtitle="a line").frames * 3, 3)
    area = (480, 300)
    (width, height), *_ = sizes(resized(row, *area))
    assert height < 100
    assert [one.subtitle for one in resized(row, *area)] == ["a line"] * 3


def test_frames_of_a_row_have_one_height():
    row = side_by_side([frame(subtitle="a line"), frame(subtitle="")], columns=2)
    assert len({height for _, height in sizes(resized(row, 900, 300))}) == 1


def test_long_tick_labels_take_width():
    long = Axis("", (0.0, 1.0), ticks=((0.5, "a label of many words"),))
    labelled = framed([], title="Marks", x=X, y=long, width=200, height=100)
    assert sizes(resized(labelled, 800, 400))[0][0] < sizes(resized(frame(), 800, 400))[0][0]


@pytest.mark.parametrize("limits", [(-5000.0, 5000.0), (0.0, 25_000.0), (0.0, 0.0005)], ids=str)
def test_long_numbers_at_automatic_ticks_take_width(limits):
    wide = sizes(resized(frame(), 800, 400))[0][0]
    assert sizes(resized(frame(y=limits), 800, 400))[0][0] < wide


def test_colour_bar_takes_width():
    ramp = Ramp("n", "count", (0.0, 5.0), label="number")
    barred = frame(glyphs=[points(TABLE, "x", "y", name="barred", color=ramp)])
    assert sizes(resized(barred, 800, 400))[0][0] < sizes(resized(frame(), 800, 400))[0][0]


def test_turned_labels_take_height():
    long = Axis("", (0.0, 1.0), ticks=((0.5, "a label of many words"),), rotation=30.0)
    turned = framed([], title="Marks", x=long, y=X, width=200, height=100)
    assert sizes(resized(turned, 800, 400))[0][1] < sizes(resized(frame(), 800, 400))[0][1]


@pytest.mark.parametrize(("area", "columns"), [((1500, 300), 3), ((300, 1200), 1)])
def test_frames_are_arranged_so_that_they_are_largest(area, columns):
    three = side_by_side([frame(height=None)] * 3, columns=2)
    assert resized(three, *area).columns == columns


def test_no_place_of_an_arrangement_is_empty_where_another_is_about_as_large():
    three = side_by_side([frame(height=100)] * 3, columns=3)
    for area in ((800, 480), (700, 420)):
        assert resized(three, *area).columns in (1, 3)


def test_subtitle_leaves_the_menu_of_the_tools_free():
    one = frame(subtitle="5,440 non-reference, 715 artificial, 325 reference sources")[0]
    for width in range(120, 500, 7):
        lines = words_of(replace(one, width=width, margin=0)).subtitle
        assert max(text_width(line, SMALL_SIZE) for line in lines) <= width - 20
    square = frame(height=None, y=(0.0, 10.0), subtitle=one.subtitle)
    for area in ((540, 290), (540, 420), (700, 300)):
        (fitted,) = resized(square, *area)
        longest = max(text_width(line, SMALL_SIZE) for line in words_of(fitted).subtitle)
        assert longest <= fitted.words_width - 20


def test_frames_above_one_another_with_one_x_axis_stay_so():
    two = side_by_side([frame()] * 2, columns=1, linked="x")
    assert resized(two, 1500, 300).columns == 1


def test_smallest_area_has_a_frame():
    assert min(sizes(resized(Figure(frame().frames * 4, 2), 0, 0))[0]) > 0


def test_labels_that_the_next_frame_repeats_are_left_out():
    four = resized(Figure(frame().frames * 4, 2), 600, 500)
    assert [(bool(one.x.label), bool(one.y.label)) for one in four] == [
        (False, True),
        (False, False),
        (True, True),
        (True, False),
    ]
    assert len({(one.width, one.frame_height) for one in four}) == 1
    other = replace(frame()[0], y=Axis("another", (0.0, 5.0)))
    row = resized(Figure((frame()[0], other), 2, "x"), 600, 300)
    assert all(one.y.label for one in row)


def test_frames_of_a_column_begin_at_one_place():
    labelled = replace(frame()[0], y=Axis("y", (0.0, 1.0), ticks=((0.5, "a long label"),)))
    rows = resized(Figure((frame()[0], labelled), 1, "x"), 400, 600)
    assert len({one.indent + one.beside for one in rows}) == 1


@pytest.mark.parametrize("area", [(508, 282), (334, 282), (436, 412)])
@pytest.mark.parametrize("count", [3, 4, 6, 9])
def test_frames_do_not_reach_beyond_their_area(area, count):
    figure = resized(Figure(frame(height=None, subtitle=WORDS).frames * count, 4), *area)
    rows = [figure.frames[n : n + figure.columns] for n in range(0, count, figure.columns)]
    for row in rows:
        assert sum(one.indent + one.beside + one.width + one.margin for one in row) <= area[0]
    assert sum(row[0].frame_height for row in rows) < area[1]


def test_a_long_label_takes_lines_beside_and_below_its_frame():
    long = "root mean square error of the mean, in one coordinate (mas)"
    axes = {"x": Axis(long, (0.0, 1.0)), "y": Axis(long, (0.0, 1.0))}
    (narrow,), (wide,) = (
        resized(framed([], title="Marks", **axes, width=200, height=100), *area)
        for area in ((320, 300), (900, 700))
    )
    assert (wide.x.label, wide.y.label) == (long, long)
    assert narrow.x.label.split() == narrow.y.label.split() == long.split()
    assert narrow.beside > wide.beside
    lines = narrow.y.label.split("\n")
    assert 2 <= len(lines) <= 3
    assert max(text_width(line, 12) for line in lines) < 290


def test_a_label_for_which_a_low_frame_has_no_room_is_left_out():
    y = Axis("a label of many words that are all of them much too long for it", (0.0, 1.0))
    (low,), (high,) = (
        resized(framed([], title="Marks", x=X, y=y, width=200, height=100), 500, height)
        for height in (150, 700)
    )
    assert (low.y.label, high.y.label) == ("", y.label)
    assert low.beside < high.beside


def test_titles_of_a_row_begin_on_one_line():
    first, last = (
        replace(frame()[0], title=text, width=110) for text in ("Marks", "Non-reference")
    )
    words = words_of_row([first, replace(last, corner=76)])
    assert [one.title for one in words] == [["\u200b", "Marks"], ["\u200b", "Non-reference"]]


WORDS = "Field 0, exposure 0. 684 measurements, one arrow each. Arrows enlarged 20,000 times"


@pytest.mark.parametrize("area", [(300, 300), (440, 280), (700, 300), (1500, 900)])
@pytest.mark.parametrize("height", [None, 100])
def test_no_word_is_wider_than_its_room(area, height):
    ((frame_of_area,), (words,)) = shown(frame(height=height, subtitle=WORDS), area)
    room = frame_of_area.words_width
    assert all(text_width(line, 13, is_bold=True) <= room for line in words.title)
    assert all(text_width(line, 11) <= room for line in words.subtitle)
    assert room <= area[0]


def test_title_leaves_the_corner_free():
    titled = replace(frame()[0], title="A title of a figure that is longer than a line")
    row = Figure((titled,) * 4, 2)
    frames = resized(row, 740, 800, corner=76)
    assert [one.corner for one in frames] == [0, 76, 0, 0]
    first, second = (words_of(one) for one in frames.frames[:2])
    room = frames[1].words_width
    assert all(text_width(line, 13, is_bold=True) <= room - 76 for line in second.title)
    assert len(second.title) > len(first.title)


def test_title_is_below_the_corner_where_there_is_no_room_beside_it():
    titled = replace(frame()[0], title="Non-reference sources", width=110, corner=76)
    assert words_of(titled).title == ["\u200b", "Non-reference", "sources"]
    assert words_of(replace(titled, width=260)).title == ["Non-reference sources"]


@pytest.mark.parametrize("area", [(380, 350), (570, 235)])
def test_a_narrow_frame_is_in_the_middle_of_its_area_and_its_words_begin_at_the_left(area):
    square = replace(frame(height=None, y=(0.0, 10.0), subtitle=WORDS)[0], title=WORDS)
    (one,) = resized(Figure((square,)), *area, corner=76)
    assert one.indent == pytest.approx(one.margin - MARGIN, abs=1)
    assert one.indent + one.beside + one.width + one.margin < area[0]
    assert one.outdent == one.indent + one.beside - 10
    assert one.frame_height > 0.35 * area[1]


def test_frames_with_the_same_labels_share_a_legend():
    first, other = (
        frame(glyphs=[line([0, 1], [0, 1], name="l", color="mark", label=label)], legend_columns=1)
        for label in ("a line", "another line")
    )
    alike, unlike = (
        resized(side_by_side(four, columns=2), 900, 700)
        for four in ([first] * 4, [first, other, first, other])
    )
    assert [bool(one.legend_columns) for one in alike] == [False, False, True, False]
    assert [bool(one.legend_columns) for one in unlike] == [False, False, True, True]


def test_the_label_of_a_left_axis_ends_below_the_words():
    long = Axis("root mean square error of the mean, in one coordinate (mas)", (0.0, 1.0))
    wordy = framed([], title="Marks", subtitle=WORDS, x=X, y=long, width=200, height=100)
    (one,) = resized(wordy, 330, 290)
    lines = one.y.label.split("\n")
    assert one.subtitle
    assert max(text_width(text, 12) for text in lines) <= one.frame_height + 2 * 18


def shown(figure, area):
    frames = resized(figure, *area).frames
    return frames, words_of_row(frames)
