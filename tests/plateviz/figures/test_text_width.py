"""Widths of text, and text wrapped to a width."""

import pytest

from plateviz.figures.text_width import has_room_for_words, text_width, wrapped

WORDS = "Field 0, exposure 0. 684 measurements, one arrow each"


# Measured with DejaVu Sans, in which Chromium shows "Helvetica, Arial, sans-serif" where there is
# no other font.
@pytest.mark.parametrize(
    ("text", "size", "is_bold", "measured"),
    [
        (WORDS, 11, False, 309.9),
        ("Arrows enlarged 20,000 times; key: 0.02 pix = 2.3 mas", 11, False, 303.5),
        ("Residuals on the focal plane, measured minus predicted", 13, True, 413.0),
        ("χ² over its expected value, by exposure", 13, True, 289.8),
    ],
)
def test_text_is_as_wide_as_in_the_widest_of_the_fonts(text, size, is_bold, measured):
    assert measured <= text_width(text, size, is_bold=is_bold) < 1.06 * measured


@pytest.mark.parametrize("width", [60, 150, 300, 1000])
def test_no_line_is_wider_than_its_room(width):
    lines = wrapped(f"{WORDS}\n{WORDS}", width, 11)
    assert all(text_width(line, 11) <= width for line in lines)
    assert "".join(lines).replace(" ", "") == 2 * WORDS.replace(" ", "")


def test_lines_are_filled_and_breaks_are_kept():
    assert wrapped("one two\nthree", 1000, 11) == ["one two", "three"]
    assert wrapped("one two", text_width("one two", 11), 11) == ["one two"]
    assert wrapped("one two", text_width("one two", 11) - 1, 11) == ["one", "two"]
    assert wrapped("", 100, 11) == []


def test_a_word_without_a_place_to_break_is_broken():
    name = "a-run-whose-name-is-longer-than-the-frame"
    lines = wrapped(f"of {name}", 80, 11)
    assert len(lines) > 2
    assert "".join(lines[1:]) == name
    assert wrapped("wide", 1, 11) == ["w", "i", "d", "e"]


def test_a_word_is_broken_after_a_hyphen_first():
    assert wrapped("Non-reference sources", text_width("reference", 13), 13) == [
        "Non-",
        "reference",
        "sources",
    ]
    assert has_room_for_words("Non-reference", text_width("reference", 13), 13)
    assert not has_room_for_words("Non-reference", text_width("referenc", 13), 13)


def test_the_last_line_has_more_than_a_word_where_it_can():
    text = "1,000 sources; noise of 1 orbit 0.71 mas; floor at 94 orbits 19 µas"
    width = text_width(text, 11) - 1
    first, last = wrapped(text, width, 11)
    assert f"{first} {last}" == text
    assert last.split()[-2:] == ["19", "µas"]
