"""Numbers at ticks and in hovers, as a real Chromium chooses and writes them."""

import pytest
from bokeh.models import LinearAxis

from plateviz.figures.figure import Axis
from plateviz.figures.hover_numbers import hover_formatters
from plateviz.figures.tick_labels import follow_policy

pytestmark = pytest.mark.ui


@pytest.mark.parametrize(
    ("widths", "expected"),
    [
        ([30, 30, 30, 30, 30], [0, 1, 2, 3, 4]),
        ([34, 34, 30, 44, 44], [0, 2, 4]),  # only those with a sign overlap
        ([44, 30, 20, 30, 44], [0, 1, 2, 3, 4]),
        ([90, 90, 90, 90, 90], [0, 3]),
        ([300, 300], [0]),
        ([], []),
    ],
)
def test_labels_are_left_out_evenly(browser, widths, expected):
    drawn = LinearAxis()
    follow_policy(drawn, Axis("x", (-2.0, 2.0)))
    policy = drawn.major_label_policy
    page = browser.new_page()
    kept = page.evaluate(
        """([code, widths, gap]) => {
          const between = (i, j) => 45 * (j - i) - (widths[i] + widths[j]) / 2;
          const every = widths.keys();
          return new Function("indices", "distance", "gap", code)(every, between, gap);
        }""",
        [policy.code, widths, policy.args["gap"]],
    )
    page.close()
    assert kept == expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [("-1234.5678", "−1,234.57"), ("-0.001", "0.00"), ("NaN", "–"), ("null", "–")],
)
def test_hover_has_a_dash_where_there_is_no_number(browser, value, expected):
    (writer,) = hover_formatters([("per cell", "@{n}{0,0.00}")], {}).values()
    page = browser.new_page()
    code = f"code => new Function('value', 'format', code)({value}, '0,0.00')"
    written = page.evaluate(code, writer.code)
    page.close()
    assert written == expected
