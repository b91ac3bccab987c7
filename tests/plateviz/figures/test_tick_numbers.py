"""Numbers at ticks, and in hovers: which are written in groups of digits, with a minus sign."""

import pytest
from bokeh.models import BasicTickFormatter, ColorBar, CustomJSTickFormatter, LinearAxis

from plateviz.figures.hover_numbers import hover_formatters
from plateviz.figures.tick_numbers import with_tick_numbers


@pytest.mark.parametrize("kind", [LinearAxis, ColorBar])
@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ((0.0, 1.0), BasicTickFormatter),
        ((0.0, 1000.0), CustomJSTickFormatter),
        ((5.0, -2.0e6), CustomJSTickFormatter),
    ],
    ids=str,
)
def test_numbers_of_four_digits_are_grouped(kind, limits, expected):
    drawn = kind()
    for _ in range(2):
        with_tick_numbers(drawn, limits, is_grouped=True)
        assert isinstance(drawn.formatter, expected) or (
            kind is ColorBar and expected is BasicTickFormatter and drawn.formatter == "auto"
        )


def test_formatter_follows_the_limits_and_stays_where_it_fits():
    drawn = LinearAxis()
    with_tick_numbers(drawn, (0.0, 2.0e4), is_grouped=True)
    grouped = drawn.formatter
    # A frame of a few seconds of a date still has other labels at each tick.
    assert "maximumFractionDigits: 9" in grouped.code
    with_tick_numbers(drawn, (0.0, 3.0e4), is_grouped=True)
    assert drawn.formatter is grouped
    with_tick_numbers(drawn, (0.0, 3.0), is_grouped=True)
    assert isinstance(drawn.formatter, BasicTickFormatter)


def test_years_are_never_grouped():
    drawn = LinearAxis()
    with_tick_numbers(drawn, (2028.0, 2031.5), is_grouped=False)
    assert isinstance(drawn.formatter, BasicTickFormatter)


def test_numbers_of_a_hover_have_one_formatter_that_stays():
    hover = [("at", "@{x}{0.00}, @{y}{0,0} mm"), ("source", "@{id}"), ("here", "$x{0.0} mas")]
    first = hover_formatters(hover, {})
    assert first.keys() == {"@{x}", "@{y}", "$x"}
    again = hover_formatters(hover[:1], first)
    assert again == {name: first["$x"] for name in ("@{x}", "@{y}")}
    assert hover_formatters(hover[1:2], {}) == {}
