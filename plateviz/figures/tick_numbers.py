"""Numbers at ticks, as in words and tables: 5,000 and 25,000, never 2.5e+4; but the year 2028."""

from bokeh import models

from plateviz.figures.figure import Limits

# From here on digits stand in groups of three.
_GROUPED = 1e3
_YEAR = "year"
# With as many decimals as a date needs in the smallest frame, none that are zero at the end, and
# with the minus of BokehJS's other numbers.
_WRITE = """
    return new Intl.NumberFormat("en-US", {maximumFractionDigits: 9}).format(tick)
      .replace("-", "\u2212")
"""


def with_tick_numbers(drawn: models.Axis | models.ColorBar, limits: Limits, label: str) -> None:
    """Let a linear axis or colour bar write its numbers as those between two limits are written.

    Parameters
    ----------
    label : of the axis or colour bar
    """
    grouped = is_grouped(limits, label)
    if isinstance(drawn.formatter, models.CustomJSTickFormatter) is not grouped:
        drawn.update(
            formatter=models.CustomJSTickFormatter(code=_WRITE)
            if grouped
            else models.BasicTickFormatter()
        )


def is_grouped(limits: Limits, label: str) -> bool:
    """Return whether the digits of numbers between two limits stand in groups; those of years not.

    Parameters
    ----------
    label : what the numbers are, with their unit
    """
    return max(map(abs, limits)) >= _GROUPED and _YEAR not in label
