"""Numbers at ticks: which are written in groups of digits."""

import pytest
from bokeh.models import BasicTickFormatter, ColorBar, CustomJSTickFormatter, LinearAxis

from plateviz.figures.tick_numbers import with_tick_numbers


@pytest.mark.parametrize("kind", [LinearAxis, ColorBar])
@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ((0.0, 1.0), BasicTickFormatter),
        # Years are never grouped.
        ((2028.0, 2031.5), BasicTickFormatter),
        ((0.0, 10_000.0), CustomJSTickFormatter),
        ((5.0, -2.0e6), CustomJSTickFormatter),
    ],
    ids=str,
)
def test_numbers_of_five_digits_are_grouped(kind, limits, expected):
    drawn = kind()
    for _ in range(2):
        with_tick_numbers(drawn, limits)
        assert isinstance(drawn.formatter, expected) or (
            kind is ColorBar and expected is BasicTickFormatter and drawn.formatter == "auto"
        )


def test_formatter_follows_the_limits_and_stays_where_it_fits():
    drawn = LinearAxis()
    with_tick_numbers(drawn, (0.0, 2.0e4))
    grouped = drawn.formatter
    # A frame of a few seconds of a date still has other labels at each tick.
    assert "maximumFractionDigits: 9" in grouped.code
    with_tick_numbers(drawn, (0.0, 3.0e4))
    assert drawn.formatter is grouped
    with_tick_numbers(drawn, (0.0, 3.0))
    assert isinstance(drawn.formatter, BasicTickFormatter)
