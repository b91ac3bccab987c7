"""PackedTexts: a column of texts that takes little to send to a page whose scripts unpack it."""

from typing import Any, Self

import numpy as np
import pandas as pd
from bokeh.core.serialization import Serializable, Serializer

TYPE = "plateviz.texts"
"""How the scripts of a page know packed texts, see `components.js` of the dashboard."""

_BETWEEN = "\n"
# Shorter columns are sent as they are.
_LEAST = 200


class PackedTexts(np.ndarray, Serializable):
    """An array of texts, each of which Bokeh would write, and a page read, by itself.

    They are written as one text. If most rows repeat others, it has each different text once, and
    the numbers of the rows' texts stand beside it.
    """

    def to_serializable(self, serializer: Serializer) -> Any:  # noqa: ANN401 as Bokeh
        """Return what is written of the column."""
        plain = np.asarray(self)
        numbers, words = pd.factorize(plain)
        if 2 * len(words) > len(plain):
            return {"type": TYPE, "texts": _BETWEEN.join(plain)}
        kind = np.min_scalar_type(len(words))
        return {
            "type": TYPE,
            "texts": _BETWEEN.join(words),
            "numbers": serializer.encode(numbers.astype(kind)),
        }

    @classmethod
    def of(cls, column: np.ndarray) -> "Self | np.ndarray":
        """Return a column, packed if it is one of many texts."""
        if column.dtype != object or column.ndim != 1 or len(column) < _LEAST:
            return column
        try:
            is_plain = _BETWEEN.join(column).count(_BETWEEN) == len(column) - 1
        except TypeError:
            # It has something else, such as arrays.
            return column
        return column.view(cls) if is_plain else column
