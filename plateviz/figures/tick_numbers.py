"""Numbers at ticks, as a journal prints them: 5000 and 25,000, with the decimals that all need."""

from bokeh import models

# As many digits as a double is sure to have, so that 0.1 + 0.2 is 0.3.
_CODE = """
    const short = number => String(+(number || 0).toPrecision(12));
    const reach = Math.max(...ticks.map(Math.abs));
    let text = short(tick);
    if (reach >= 1e-4 && reach < 1e12) {
      const digits = Math.max(...ticks.map(one => (short(one).split(".")[1] ?? "").length));
      text = (+text).toLocaleString("en-US", {
        minimumFractionDigits: digits, maximumFractionDigits: digits, useGrouping: reach >= 1e4,
      });
    }
    return text.replaceAll("-", "−");
"""


def tick_numbers() -> models.CustomJSTickFormatter:
    """Return what writes the numbers at the ticks of a linear axis or colour bar."""
    return models.CustomJSTickFormatter(code=_CODE)
