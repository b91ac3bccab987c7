"""Glyph tables of every kind, from tables or arrays."""

import re
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from plateviz.figures.figure import By, Glyphs, Kind, Limits, Look, Ramp, Tooltips

_FIELD = re.compile(r"@\{(\w+)\}")
Table = pd.DataFrame | Mapping[str, object]
Values = np.ndarray | pd.Series | Sequence[float]


def points(
    table: Table,
    x: str,
    y: str,
    *,
    name: str,
    color: Look,
    size: Look = 5.0,
    marker: Look = "circle",
    alpha: Look = 1.0,
    fill_alpha: Look = None,
    line_color: Look = None,
    line_width: float = 1.0,
    hover: Tooltips = (),
    label: str = "",
    keep: Sequence[str] = (),
) -> Glyphs:
    """Return a mark per row.

    Parameters
    ----------
    x, y : names of the columns with the coordinates
    color : of the fill
    line_color : of the outline; the fill's by default
    fill_alpha : opacity of the fill; `alpha` by default
    keep : columns that neither the hover nor a look needs
    """
    looks = {
        "size": size,
        "marker": marker,
        "fill_color": color,
        "fill_alpha": alpha if fill_alpha is None else fill_alpha,
        "line_color": color if line_color is None else line_color,
        "line_alpha": alpha,
        "line_width": line_width,
    }
    return _glyphs("points", name, table, {"x": x, "y": y}, looks, hover, label, keep)


def line(
    x: Values,
    y: Values,
    *,
    name: str,
    color: Look,
    width: float = 1.6,
    dash: str = "solid",
    alpha: float = 1.0,
    label: str = "",
    hover: Tooltips = (),
    keep: Mapping[str, object] | None = None,
) -> Glyphs:
    """Return a line through the points; `keep` has other columns that the hover needs."""
    table = {"x": x, "y": y, **(keep or {})}
    looks = _stroke(color, width, dash, alpha)
    return _glyphs("line", name, table, _same("x", "y"), looks, hover, label)


def segments(
    x0: Values,
    y0: Values,
    x1: Values,
    y1: Values,
    *,
    name: str,
    color: Look,
    width: float = 1.2,
    alpha: Look = 1.0,
    keep: Mapping[str, object] | None = None,
) -> Glyphs:
    """Return a straight stroke per row; `keep` has other columns."""
    table = {"x0": x0, "y0": y0, "x1": x1, "y1": y1, **(keep or {})}
    looks = {"line_color": color, "line_width": width, "line_alpha": alpha}
    return _glyphs(
        "segments", name, table, _same("x0", "y0", "x1", "y1"), looks, keep=list(keep or ())
    )


def rectangles(
    table: Table,
    *,
    name: str,
    color: Look,
    line_color: Look = None,
    line_width: float = 1.0,
    hover: Tooltips = (),
    label: str = "",
) -> Glyphs:
    """Return a rectangle per row, from its columns `left`, `right`, `bottom` and `top`.

    Parameters
    ----------
    line_color : of the outline; none by default
    """
    looks = {"fill_color": color, "line_color": line_color, "line_width": line_width}
    return _glyphs(
        "rectangles", name, table, _same("left", "right", "bottom", "top"), looks, hover, label
    )


def texts(
    x: Values,
    y: Values,
    text: Sequence[str] | pd.Series,
    *,
    name: str,
    color: Look = "text",
    size: str = "11px",
    align: Look = "center",
    baseline: Look = "middle",
    is_bold: bool = False,
    keep: Mapping[str, object] | None = None,
) -> Glyphs:
    """Return a text per row.

    Parameters
    ----------
    align, baseline : which part of the text is at the point; a `By` for a part per row
    keep : columns that a look needs
    """
    table = {"x": x, "y": y, "text": np.asarray(list(text), dtype=object), **(keep or {})}
    looks = {
        "text_color": color,
        "text_font_size": size,
        "text_align": align,
        "text_baseline": baseline,
        "text_font_style": "bold" if is_bold else "normal",
    }
    return _glyphs("texts", name, table, _same("x", "y", "text"), looks)


def paths(
    outlines: Sequence[np.ndarray],
    *,
    name: str,
    color: Look,
    width: float = 1.0,
    dashes: Sequence[str] | str = "solid",
) -> Glyphs:
    """Return a path per outline, an array of points (n, 2).

    Parameters
    ----------
    dashes : of all paths, or of each
    """
    each = [dashes] * len(outlines) if isinstance(dashes, str) else list(dashes)
    table = {
        "xs": _ragged([outline[:, 0] for outline in outlines]),
        "ys": _ragged([outline[:, 1] for outline in outlines]),
        "dash": np.asarray(each, dtype=object),
    }
    looks = {"line_color": color, "line_width": width}
    at = {"xs": "xs", "ys": "ys", "line_dash": "dash"}
    return _glyphs("paths", name, table, at, looks)


def band(
    x: Values,
    low: Values,
    high: Values,
    *,
    name: str,
    color: Look = "muted",
    alpha: float = 0.22,
    label: str = "",
) -> Glyphs:
    """Return the area between two curves."""
    looks = {"fill_color": color, "fill_alpha": alpha}
    at = {"x": "x", "y1": "low", "y2": "high"}
    return _glyphs("band", name, {"x": x, "low": low, "high": high}, at, looks, (), label)


def horizontal(
    y: Values | float,
    *,
    name: str = "horizontal",
    color: Look = "line",
    width: float = 1.2,
    dash: str = "dashed",
    alpha: float = 1.0,
) -> Glyphs:
    """Return lines across the whole frame at each `y`."""
    looks = _stroke(color, width, dash, alpha)
    return _glyphs("horizontal", name, {"y": np.atleast_1d(y)}, _same("y"), looks)


def vertical(
    x: Values | float,
    *,
    name: str = "vertical",
    color: Look = "line",
    width: float = 1.2,
    dash: str = "dashed",
    alpha: float = 1.0,
) -> Glyphs:
    """Return lines from the bottom to the top of the frame at each `x`."""
    looks = _stroke(color, width, dash, alpha)
    return _glyphs("vertical", name, {"x": np.atleast_1d(x)}, _same("x"), looks)


def strip(low: float, high: float, *, name: str = "strip", alpha: float = 0.22) -> Glyphs:
    """Return a strip across the whole frame between two heights."""
    looks: dict[str, Look] = {"fill_color": "muted", "fill_alpha": alpha, "line_color": None}
    at = {"y0": "low", "y1": "high"}
    return _glyphs("strip", name, {"low": [low], "high": [high]}, at, looks)


def image(
    values: np.ndarray,
    x: Limits,
    y: Limits,
    *,
    name: str,
    ramp: Ramp,
    hover: Tooltips = (),
    reach: Limits | None = None,
) -> Glyphs:
    """Return an image whose cells fill the area between the limits; NaN is transparent.

    Parameters
    ----------
    values : (rows, columns), the first row at the bottom
    x, y : limits of the area, ascending
    ramp : colours of the values; its column is `ramp.column`
    hover : "$x" and "$y" are the place of the cursor, "@{name}" with `ramp.column` the value
    reach : see `Glyphs`
    """
    cells = np.empty(1, dtype=object)
    cells[0] = np.asarray(values, dtype=float)
    area = {"x": [x[0]], "y": [y[0]], "dw": [x[1] - x[0]], "dh": [y[1] - y[0]]}
    table = {ramp.column: cells, **area}
    at = {"image": ramp.column, **_same("x", "y", "dw", "dh")}
    columns = {key: np.asarray(column) for key, column in table.items()}
    return Glyphs("image", name, columns, at, {"color": ramp}, tuple(hover), "", reach)


def ellipse(
    covariance: np.ndarray,
    *,
    name: str,
    color: Look = "line",
    width: float = 1.8,
    dash: str = "solid",
    scale: float = 1.0,
    label: str = "",
) -> Glyphs:
    """Return the ellipse of one sigma times `scale` of a covariance (2, 2), about zero."""
    values, vectors = np.linalg.eigh(np.asarray(covariance, dtype=float))
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    axes = scale * np.sqrt(np.clip(values, 0.0, None))[:, None]
    x, y = vectors @ (axes * np.array([np.cos(turn), np.sin(turn)]))
    return line(x, y, name=name, color=color, width=width, dash=dash, label=label)


def _stroke(color: Look, width: float, dash: str, alpha: float) -> dict[str, Look]:
    return {"line_color": color, "line_width": width, "line_dash": dash, "line_alpha": alpha}


def _same(*names: str) -> dict[str, str]:
    return {name: name for name in names}


def _glyphs(
    kind: Kind,
    name: str,
    table: Table,
    at: Mapping[str, str],
    looks: Mapping[str, Look],
    hover: Tooltips = (),
    label: str = "",
    keep: Sequence[str] = (),
) -> Glyphs:
    by = [look.column for look in looks.values() if isinstance(look, By | Ramp)]
    shown = [field for _, text in hover for field in _FIELD.findall(text)]
    legend = [label[1:]] if label.startswith("@") else []
    needed = dict.fromkeys([*at.values(), *by, *shown, *legend, *keep])
    columns = {column: np.asarray(table[column]) for column in needed}
    return Glyphs(kind, name, columns, dict(at), dict(looks), tuple(hover), label)


def _ragged(rows: Sequence[np.ndarray]) -> np.ndarray:
    found = np.empty(len(rows), dtype=object)
    for number, row in enumerate(rows):
        found[number] = np.asarray(row, dtype=float)
    return found
