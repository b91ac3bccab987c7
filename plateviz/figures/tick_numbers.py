"""Numbers at ticks, as in words and tables: 5,000 and 25,000, never 2.5e+4; but the year 2028."""

from bokeh import models

from plateviz.figures.figure import Limits

# From here on digits stand in groups of three.
_GROUPED = 1e3
# With as many decimals as a date needs in the smallest frame, none that are zero at the end, and
# with the minus of BokehJS's other numbers.
_WRITE = """
    return new Intl.NumberFormat("en-US", {maximumFractionDigits: 9}).format(tick)
      .replace("-", "\u2212")
"""


def with_tick_numbers(
    drawn: models.Axis | models.ColorBar, limits: Limits, *, is_grouped: bool
) -> None:
    """Let a linear axis or colour bar write its numbers as those between two limits are written.

    Parameters
    ----------
    is_grouped : as in `Axis`
    """
    is_large = is_grouped and has_groups(limits)
    if isinstance(drawn.formatter, models.CustomJSTickFormatter) is not is_large:
        drawn.update(
            formatter=models.CustomJSTickFormatter(code=_WRITE)
            if is_large
            else models.BasicTickFormatter()
        )


def with_whole_ticks(bar: models.ColorBar, is_whole: bool) -> None:
    """Let a colour bar have ticks at whole numbers only, or where Bokeh has them."""
    if isinstance(bar.ticker, models.BasicTicker) is not is_whole:
        bar.ticker = models.BasicTicker(min_interval=1.0) if is_whole else "auto"


def has_groups(limits: Limits) -> bool:
    """Return whether the digits of numbers between two limits can stand in groups."""
    return max(map(abs, limits)) >= _GROUPED
