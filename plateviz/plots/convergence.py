"""Convergence of a fit: largest step and objective against iteration."""

import holoviews as hv
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.style import PANEL_WIDTH, drawn, framed, message, side_by_side
from plateviz.plots.theme import theme_of
from plateviz.tables.convergence import convergence, loss_excess

_TITLE = "Convergence"
_X = hv.Dimension("iteration", label="iteration")
_HOVER = [
    ("iteration", "@{iteration}"),
    ("objective", "@{objective}{0,0.00}"),
    ("χ² of the data", "@{chi2}{0,0.00}"),
    ("largest step", "@{step_text} σ"),
    ("parameter", "@{largest_parameter}"),
    ("damping", "@{damping_text}"),
    ("time", "@{seconds}{0.00} s"),
]
_LOG_FROM = 20.0
_MARKERS_UP_TO = 200
_TICKS_UP_TO = 12
# A hundredth of the contribution of one source's two coordinates to the loss.
_LOWEST_EXCESS = 0.01


def plot_convergence(
    table: pd.DataFrame,
    losses: pd.DataFrame | None = None,
    *,
    theme: str = "light",
    width: int = PANEL_WIDTH,
) -> hv.Layout | hv.Overlay:
    """Draw the largest scaled step with its tolerance, and the objective or loss beside it.

    Parameters
    ----------
    table : `tables.convergence`
    losses : `tables.loss_excess`; drawn instead of the objective if not empty
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(
            _TITLE,
            "No iterations",
            theme=theme,
            width=width,
            xlabel=_X.label,
            ylabel="largest step (σ of the parameter)",
        )
    second = (
        _objective(table, theme, width)
        if losses is None or losses.empty
        else _losses(losses, theme, width)
    )
    return side_by_side([_steps(table, theme, width), second], columns=2)


def _steps(table: pd.DataFrame, theme: str, width: int) -> hv.Overlay:
    rows = table[table["largest_step"] > 0]
    tolerance = float(table["tolerance"].iloc[0])
    values = pd.concat([rows["largest_step"], table["tolerance"]])
    line = hv.HLine(tolerance)
    # On the left, where the trace is far above the tolerance.
    text = f" tolerance {tolerance:g} σ"
    label = hv.Text(_limits(table)[0], tolerance, text, halign="left", valign="bottom")
    colours = theme_of(theme)
    return framed(
        [
            drawn(line, color=colours.line, line_dash="dashed", line_width=1.4),
            drawn(label, text_color=colours.text, text_font_size="11px"),
            *_trace(rows, "largest_step", theme),
        ],
        title="Largest step of each iteration",
        subtitle=_last_step(rows, tolerance),
        theme=theme,
        width=width,
        height=round(0.75 * width),
        logy=True,
        xlim=_limits(table),
        xticks=_whole_ticks(table),
        ylim=(0.4 * float(values.min()), 2.5 * float(values.max())),
        xlabel=_X.label,
        ylabel="largest step (σ of the parameter)",
    )


def _objective(table: pd.DataFrame, theme: str, width: int) -> hv.Overlay:
    values = table["objective"]
    first, last = float(values.iloc[0]), float(values.iloc[-1])
    log = last > 0 and float(values.max()) > _LOG_FROM * float(values.min()) > 0
    low, high = float(values.min()), float(values.max())
    margin = 0.08 * (high - low or abs(high) or 1.0)
    return framed(
        _trace(table, "objective", theme),
        title="Objective: χ² of data and priors",
        subtitle=f"from {first:,.6g} to {last:,.6g}",
        theme=theme,
        width=width,
        height=round(0.75 * width),
        logy=log,
        xlim=_limits(table),
        xticks=_whole_ticks(table),
        ylim=(low / 1.5, high * 1.5) if log else (low - margin, high + margin),
        xlabel=_X.label,
        ylabel="objective (χ²)",
    )


def _losses(losses: pd.DataFrame, theme: str, width: int) -> hv.Overlay:
    # The last losses scatter about the final level; those below it have no logarithm.
    above = losses[losses["excess"] > _LOWEST_EXCESS]
    last = float(losses["step"].iloc[-1])
    curve = hv.Curve(above, hv.Dimension("step", label="step"), ["excess", "loss"])
    return framed(
        [
            drawn(
                curve,
                color=theme_of(theme).mark,
                line_width=1.4,
                tools=["hover"],
                hover_tooltips=[("step", "@{step}"), ("loss", "@{loss}{0,0.00}")],
            )
        ],
        title="Loss above its final level",
        subtitle=f"loss: minus the evidence lower bound; final {losses['loss'].iloc[-1]:,.6g}",
        theme=theme,
        width=width,
        height=round(0.75 * width),
        logy=True,
        xlim=(-0.02 * last, 1.02 * last),
        ylim=(_LOWEST_EXCESS, 2.0 * float(above["excess"].max() if len(above) else 1.0)),
        xlabel="step",
        ylabel="loss above its final level",
    )


def _limits(table: pd.DataFrame) -> tuple[float, float]:
    last = float(table["iteration"].max())
    return -0.04 * last - 0.2, 1.04 * last + 0.2


def _whole_ticks(table: pd.DataFrame) -> list[int] | None:
    last = int(table["iteration"].max())
    return list(range(last + 1)) if last <= _TICKS_UP_TO else None


def _last_step(rows: pd.DataFrame, tolerance: float) -> str:
    if rows.empty:
        return "no step taken"
    last = rows.iloc[-1]
    verdict = "below" if last["largest_step"] < tolerance else "above"
    # The parameter is last, because it may be cut off: source ids have nineteen digits.
    return f"{verdict} tolerance: {last['largest_step']:.2g} σ ({last['largest_parameter']})"


def _trace(rows: pd.DataFrame, column: str, theme: str) -> list[hv.Element]:
    colour = theme_of(theme).mark
    rows = rows.assign(
        step_text=[f"{value:.2g}" for value in rows["largest_step"]],
        damping_text=[f"{value:.2g}" for value in rows["damping"]],
    )
    extra = [c for c in rows.columns if c not in ("iteration", column)]
    curve = hv.Curve(rows, _X, [column, *extra])
    points = hv.Points(rows, [_X, column], extra)
    size = 7 if len(rows) <= _MARKERS_UP_TO else 0
    return [
        drawn(curve, color=colour, line_width=1.8),
        drawn(
            points,
            color=colour,
            size=size,
            tools=["hover"],
            hover_tooltips=_HOVER,
        ),
    ]


def _draw(chosen: Chosen, theme: str) -> hv.Layout | hv.Overlay:
    return plot_convergence(convergence(chosen.result), loss_excess(chosen.result), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "convergence",
        "Convergence",
        "The largest step of any parameter over its uncertainty, and the objective or, for svi, "
        "the loss. Good: the last step is far below the tolerance.",
        90,
        _draw,
        is_wide=True,
    ),
)
