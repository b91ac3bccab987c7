"""Choice of the distortion order: evidence and reserved sources against the order."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from plateviz.figures.figure import (
    Axis,
    Figure,
    Glyphs,
    Limits,
    Ticks,
    Tooltips,
    framed,
    message,
    side_by_side,
)
from plateviz.figures.glyphs import band, horizontal, line, points, vertical
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import PANEL_WIDTH, SERIES_COLOURS
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.orders import order_comparison, preferred_order
from solver.data.plural import plural
from solver.data.settings import MAX_ORDER

_TITLE = "Orders of the distortion"
_DIFFERENCE = "Evidence and prediction, against the best order"
_HELD_OUT = "χ² of the reserved sources, by order"
_XLABEL = "order of the distortion"
_DIFFERENCE_Y, _HELD_OUT_Y = "log probability minus the best (nat)", "χ² / dof"
_SERIES = (
    ("evidence_below_best", "log evidence", "circle"),
    ("log_density_below_best", "log density of the reserved sources", "triangle"),
)
_HOVER = [
    ("order", "@{order}"),
    ("coefficients", "@{n_terms}"),
    ("below the best", "@{below}{0,0.0}"),
    ("criterion", "@{series}"),
]
_HELD_OUT_HOVER = [
    ("order", "@{order}"),
    ("reserved sources", "@{n_reserved}"),
    ("their χ² / dof", "@{held_out_chi2_per_dof}{0.0000} ± @{held_out_sd}{0.0000}"),
    ("χ² / dof of all", "@{chi2_per_dof}{0.0000}"),
]
_BAND_SIGMAS = 2.0
# Candidates of the ticks; chosen ones are at least `_APART` of the axis apart.
_LOSSES = (0.0, *(float(10**k) for k in range(10)))
_RATIOS = (
    *(0.5, 0.8, 0.9, 0.95, 0.98, 0.99, 1.0, 1.01, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0, 5.0),
    *(float(10**k) for k in range(1, 9)),
)
_APART = 0.08


def plot_orders(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw the evidence of each order, and its prediction of the reserved sources.

    Both axes are linear near their best value and logarithmic far from it.

    Parameters
    ----------
    table : `tables.order_comparison`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No orders compared: switch on “Compare all orders” under Refit, then fit"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_DIFFERENCE_Y)
    return side_by_side([_differences(table, width), _held_out(table, width)], columns=2)


def _differences(table: pd.DataFrame, width: int) -> Figure:
    glyphs = [_fitted(table)]
    values = [np.zeros(1)]
    for (column, name, marker), colour in zip(_SERIES, SERIES_COLOURS, strict=False):
        rows = table.dropna(subset=[column])
        if rows.empty:
            continue
        height = -np.arcsinh(rows[column].to_numpy())
        rows = rows.assign(height=height, below=rows[column], series=name)
        values.append(height)
        glyphs += _series(rows, name, colour, marker, _HOVER)
    low = 1.12 * min(float(np.concatenate(values).min()), -1.5)
    ticks = _ticks(-np.arcsinh(_LOSSES), [f"−{loss:,.0f}" for loss in _LOSSES], low, 0.0)
    return framed(
        glyphs,
        title=_DIFFERENCE,
        subtitle=_subtitle(table),
        x=_x_axis(table),
        y=Axis(
            _DIFFERENCE_Y,
            (low, -0.1 * low),
            ticks=[(place, label.replace("−0", "0")) for place, label in ticks],
        ),
        width=width,
        height=round(0.75 * width),
        legend_columns=1,
    )


def _held_out(table: pd.DataFrame, width: int) -> Figure:
    rows = table.dropna(subset=["held_out_chi2_per_dof"])
    if rows.empty:
        text = "No reserved sources"
        return message(_HELD_OUT, text, width=width, xlabel=_XLABEL, ylabel=_HELD_OUT_Y)
    spread, reserved = float(rows["held_out_sd"].max()), int(rows["n_reserved"].iloc[0])
    scale = _BAND_SIGMAS * spread
    rows = rows.assign(height=np.arcsinh((rows["held_out_chi2_per_dof"] - 1.0) / scale))
    edge = float(np.arcsinh(1.0))
    low = min(float(rows["height"].min()), -edge) - 0.6
    high = max(float(rows["height"].max()), edge) * 1.1 + 0.3
    places = np.arcsinh((np.array(_RATIOS) - 1.0) / scale)
    expected = f"expected ± {_BAND_SIGMAS:g}σ"
    return framed(
        [
            band(_limits(table), [-edge] * 2, [edge] * 2, name="band", label=expected),
            horizontal(0.0, name="expected"),
            _fitted(table),
            *_series(rows, "reserved sources", "mark", "triangle", _HELD_OUT_HOVER),
        ],
        title=_HELD_OUT,
        subtitle=f"{reserved:,} {plural(reserved, 'source')}, with the calibration fitted to the "
        f"others\nexpected: 1 ± {spread:.3f} for a sufficient order",
        x=_x_axis(table),
        y=Axis(
            _HELD_OUT_Y,
            (low, high),
            ticks=_ticks(places, [f"{ratio:,g}" for ratio in _RATIOS], low, high),
        ),
        width=width,
        height=round(0.75 * width),
        legend_columns=1,
    )


def _subtitle(table: pd.DataFrame) -> str:
    """Return two lines, as in the other panel."""
    names = {"evidence": "evidence_below_best", "prediction": "log_density_below_best"}
    found = {name: preferred_order(table, column) for name, column in names.items()}
    best = [f"best {name}: order {order}" for name, order in found.items() if order is not None]
    if found["evidence"] is None:
        best.insert(0, "no evidence under a flat prior")
    fitted = table.loc[table["is_fitted"], "order"]
    second = [f"fitted: order {order}, dotted" for order in fitted]
    if table["order"].max() < MAX_ORDER:
        second.append(f"above {table['order'].max()} too few data")
    return f"{'; '.join(best)}\n{'; '.join(second)}"


def _series(
    rows: pd.DataFrame, name: str, colour: str, marker: str, hover: Tooltips
) -> list[Glyphs]:
    """Return a line and a mark at the `height` of each order, with one entry in the legend."""
    return [
        line(rows["order"], rows["height"], name=name, color=colour, width=1.8, label=name),
        points(
            rows,
            "order",
            "height",
            name=f"{name}, marks",
            color=colour,
            marker=marker,
            size=8.0,
            hover=hover,
            label=name,
        ),
    ]


def _fitted(table: pd.DataFrame) -> Glyphs:
    """Return a vertical line at the fitted order."""
    orders = table.loc[table["is_fitted"], "order"]
    return vertical(orders.to_numpy(), name="fitted", dash="dotted")


def _x_axis(table: pd.DataFrame) -> Axis:
    ticks = [(float(order), str(order)) for order in table["order"]]
    return Axis(_XLABEL, _limits(table), ticks=ticks)


def _limits(table: pd.DataFrame) -> Limits:
    return float(table["order"].min()) - 0.5, float(table["order"].max()) + 0.5


def _ticks(places: Iterable[float], labels: Iterable[str], low: float, high: float) -> Ticks:
    """Return ticks within the axis that do not overlap; those near zero take precedence."""
    chosen: list[tuple[float, str]] = []
    for place, label in sorted(zip(places, labels, strict=True), key=lambda tick: abs(tick[0])):
        apart = _APART * (high - low)
        if low <= place <= high and all(abs(place - other) >= apart for other, _ in chosen):
            chosen.append((float(place), label))
    return sorted(chosen)


_PAGE_WIDTH = 400


def _plot(chosen: Chosen) -> Figure:
    return plot_orders(order_comparison(chosen.result), width=_PAGE_WIDTH)


DIAGNOSTICS = (
    Diagnostic(
        "orders",
        "Choosing the order",
        "The evidence of every order of the distortion, and how well its calibration predicts "
        "reserved sources that were kept out of the fit. The dotted line is the fitted order. "
        "Good: it has the highest evidence (5 less is odds of 1 to 150), and from it upwards "
        "the chi2 of the reserved sources is inside the band.",
        OrbitWorkspace.ORDERS,
        82,
        _plot,
        is_wide=True,
        has_data=lambda chosen: chosen.result.orders is not None,
        equation="ln evidence (Laplace); odds of two orders = exp(difference of ln evidence)",
    ),
)
