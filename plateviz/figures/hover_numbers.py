"""Numbers in hovers, with the minus sign of words and ticks, and none before zero."""

import re
from collections.abc import Mapping

from bokeh import models

from plateviz.figures.figure import Tooltips

_FIELD = re.compile(r"(@\{\w+\}|\$[xy])\{0[0,.]*\}")
# Bokeh's own formatter writes "-0.00" for a small negative number.
_WRITE = """
    if (value == null || Number.isNaN(value)) return "–"
    const decimals = (format.split(".")[1] ?? "").length
    const options = {
      minimumFractionDigits: decimals, maximumFractionDigits: decimals,
      useGrouping: format.includes(","),
    }
    return new Intl.NumberFormat("en-US", options).format(value)
      .replace(/^-(?=[0.,]*$)/, "").replace("-", "\u2212")
"""


def hover_formatters(
    hover: Tooltips, drawn: Mapping[str, object]
) -> dict[str, models.CustomJSHover]:
    """Return field -> what writes its number, for all fields of a hover that have a format.

    Parameters
    ----------
    hover : label and format of each line
    drawn : of the hover until now, whose model is kept
    """
    fields = [field for _, text in hover for field in _FIELD.findall(text)]
    if not fields:
        return {}
    known = (one for one in drawn.values() if isinstance(one, models.CustomJSHover))
    model = next(known, None) or models.CustomJSHover(code=_WRITE)
    return dict.fromkeys(fields, model)
