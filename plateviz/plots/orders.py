"""Choice of the distortion order: evidence and reserved sources against the order."""

from collections.abc import Iterable

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.style import (
    PANEL_WIDTH,
    SERIES_COLOURS,
    AxisLabels,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.theme import theme_of
from plateviz.tables.orders import order_comparison, preferred_order
from solver.data.settings import MAX_ORDER

_TITLE = "Orders of the distortion"
_DIFFERENCE = "Evidence and prediction, against the best order"
_HELD_OUT = "χ² of the reserved sources, by order"
_XLABEL = "order of the distortion"
_LABELS: AxisLabels = {"xlabel": _XLABEL, "ylabel": "log probability minus the best (nat)"}
_HELD_OUT_LABELS: AxisLabels = {"xlabel": _XLABEL, "ylabel": "χ² / dof"}
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


def plot_orders(
    table: pd.DataFrame, *, theme: str = "light", width: int = PANEL_WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw the evidence of each order, and its prediction of the reserved sources.

    Both axes are linear near their best value and logarithmic far from it.

    Parameters
    ----------
    table : `tables.order_comparison`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No orders compared: switch it on under Refit, then fit"
        return message(_TITLE, text, theme=theme, width=width, **_LABELS)
    panels = [_differences(table, theme, width), _held_out(table, theme, width)]
    return side_by_side(panels, columns=2)


def _differences(table: pd.DataFrame, theme: str, width: int) -> hv.Overlay:
    elements = [*_fitted(table, theme)]
    values = [np.zeros(1)]
    for (column, name, marker), colour in zip(_SERIES, SERIES_COLOURS, strict=False):
        rows = table.dropna(subset=[column])
        if rows.empty:
            continue
        height = -np.arcsinh(rows[column].to_numpy())
        rows = rows.assign(height=height, below=rows[column], series=name)
        values.append(height)
        elements += _line(rows, "height", ["n_terms", "below", "series"], name, colour, marker)
    low = 1.12 * min(float(np.concatenate(values).min()), -1.5)
    ticks = _ticks(-np.arcsinh(_LOSSES), [f"−{loss:,.0f}" for loss in _LOSSES], low, 0.0)
    return framed(
        elements,
        title=_DIFFERENCE,
        subtitle=_subtitle(table),
        theme=theme,
        width=width,
        height=round(0.75 * width),
        xlim=_limits(table),
        ylim=(low, -0.1 * low),
        xticks=table["order"].tolist(),
        yticks=[(place, label.replace("−0", "0")) for place, label in ticks],
        legend_columns=1,
        **_LABELS,
    )


def _held_out(table: pd.DataFrame, theme: str, width: int) -> hv.Overlay:
    rows = table.dropna(subset=["held_out_chi2_per_dof"])
    if rows.empty:
        text = "No reserved sources"
        return message(_HELD_OUT, text, theme=theme, width=width, **_HELD_OUT_LABELS)
    colours, spread = theme_of(theme), float(rows["held_out_sd"].max())
    scale = _BAND_SIGMAS * spread
    rows = rows.assign(height=np.arcsinh((rows["held_out_chi2_per_dof"] - 1.0) / scale))
    edge = float(np.arcsinh(1.0))
    low = min(float(rows["height"].min()), -edge) - 0.6
    high = max(float(rows["height"].max()), edge) * 1.1 + 0.3
    places = np.arcsinh((np.array(_RATIOS) - 1.0) / scale)
    first, last = _limits(table)
    band = hv.Area(
        ([first, last], [-edge] * 2, [edge] * 2),
        "order",
        ["low", "high"],
        label=f"expected ± {_BAND_SIGMAS:g}σ",
    )
    extra = ["n_reserved", "held_out_chi2_per_dof", "held_out_sd", "chi2_per_dof"]
    return framed(
        [
            drawn(band, color=colours.muted, alpha=0.22, line_alpha=0.0),
            drawn(hv.HLine(0.0), color=colours.line, line_width=1.2, line_dash="dashed"),
            *_fitted(table, theme),
            *_line(rows, "height", extra, "reserved sources", colours.mark, "triangle"),
        ],
        title=_HELD_OUT,
        subtitle=f"{rows['n_reserved'].iloc[0]:,} sources, with the calibration fitted to the "
        f"others\nexpected: 1 ± {spread:.3f} for a sufficient order",
        theme=theme,
        width=width,
        height=round(0.75 * width),
        xlim=(first, last),
        ylim=(low, high),
        xticks=table["order"].tolist(),
        yticks=_ticks(places, [f"{ratio:,g}" for ratio in _RATIOS], low, high),
        legend_columns=1,
        **_HELD_OUT_LABELS,
    )


def _subtitle(table: pd.DataFrame) -> str:
    """Return two lines, as in the other panel, because panels of unequal height are clipped."""
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


def _line(
    rows: pd.DataFrame, y: str, extra: list[str], name: str, colour: str, marker: str
) -> list[hv.Element]:
    curve = hv.Curve(rows, "order", y, label=name)
    points = hv.Points(rows, ["order", y], extra, label=name)
    hover = _HOVER if "below" in extra else _HELD_OUT_HOVER
    return [
        drawn(curve, color=colour, line_width=1.8),
        drawn(points, color=colour, marker=marker, size=8, tools=["hover"], hover_tooltips=hover),
    ]


def _fitted(table: pd.DataFrame, theme: str) -> list[hv.Element]:
    """Return a vertical line at the fitted order."""
    colour = theme_of(theme).line
    orders = table.loc[table["is_fitted"], "order"]
    return [drawn(hv.VLine(x), color=colour, line_width=1.2, line_dash="dotted") for x in orders]


def _limits(table: pd.DataFrame) -> tuple[float, float]:
    return float(table["order"].min()) - 0.5, float(table["order"].max()) + 0.5


def _ticks(
    places: Iterable[float], labels: Iterable[str], low: float, high: float
) -> list[tuple[float, str]]:
    """Return ticks within the axis that do not overlap; those near zero take precedence."""
    chosen: list[tuple[float, str]] = []
    for place, label in sorted(zip(places, labels, strict=True), key=lambda tick: abs(tick[0])):
        apart = _APART * (high - low)
        if low <= place <= high and all(abs(place - other) >= apart for other, _ in chosen):
            chosen.append((float(place), label))
    return sorted(chosen)


_PAGE_WIDTH = 400


def _draw(chosen: Chosen, theme: str) -> hv.Layout | hv.Overlay:
    return plot_orders(order_comparison(chosen.result), theme=theme, width=_PAGE_WIDTH)


DIAGNOSTICS = (
    Diagnostic(
        "orders",
        "Choosing the order",
        "The evidence of every order of the distortion, and how well its calibration predicts "
        "reserved sources that were kept out of the fit. The dotted line is the fitted order. "
        "Good: it has the highest evidence (5 less is odds of 1 to 150), and from it upwards "
        "the chi2 of the reserved sources is inside the band.",
        82,
        _draw,
        is_wide=True,
        has_data=lambda chosen: chosen.result.orders is not None,
    ),
)
