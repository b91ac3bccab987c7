"""Convergence of a fit: largest step and objective against iteration."""

import pandas as pd

from plateviz.figures.figure import (
    Axis,
    Figure,
    Glyphs,
    Limits,
    Ticks,
    framed,
    message,
    side_by_side,
)
from plateviz.figures.glyphs import horizontal, line, points, texts
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import PANEL_WIDTH
from plateviz.plots.elements.units import power_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.convergence import convergence, loss_excess

_TITLE = "Convergence"
_XLABEL, _STEP = "iteration", "largest step (σ of the parameter)"
_HOVER = [
    ("iteration", "@{iteration}"),
    ("objective", "@{objective}{0,0.00}"),
    ("χ² of the data", "@{chi2}{0,0.00}"),
    ("largest step", "@{step_text} σ"),
    ("parameter", "@{largest_parameter}"),
    ("damping", "@{damping_text}"),
    ("time", "@{seconds}{0.00} s"),
]
_LOSS_HOVER = [("step", "@{x}"), ("loss", "@{loss}{0,0.00}")]
_LOG_FROM = 20.0
_MARKERS_UP_TO = 200
_TICKS_UP_TO = 12
# A hundredth of the contribution of one source's two coordinates to the loss.
_LOWEST_EXCESS = 0.01


def plot_convergence(
    table: pd.DataFrame, losses: pd.DataFrame | None = None, *, width: int = PANEL_WIDTH
) -> Figure:
    """Draw the largest scaled step with its tolerance, and the objective or loss beside it.

    Parameters
    ----------
    table : `tables.convergence`
    losses : `tables.loss_excess`; drawn instead of the objective if not empty
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No iterations", width=width, xlabel=_XLABEL, ylabel=_STEP)
    second = _objective(table, width) if losses is None or losses.empty else _losses(losses, width)
    return side_by_side([_steps(table, width), second], columns=2)


def _steps(table: pd.DataFrame, width: int) -> Figure:
    rows = table[table["largest_step"] > 0]
    tolerance = float(table["tolerance"].iloc[0])
    values = pd.concat([rows["largest_step"], table["tolerance"]])
    limits = _limits(table)
    return framed(
        [
            horizontal(tolerance, name="tolerance", width=1.4),
            # On the left, where the trace is far above the tolerance.
            texts(
                [limits[0]],
                [tolerance],
                [f" tolerance {tolerance:g} σ"],
                name="tolerance text",
                align="left",
                baseline="bottom",
            ),
            *_trace(rows, "largest_step"),
        ],
        title="Largest step of each iteration",
        subtitle=_last_step(rows, tolerance),
        x=Axis(_XLABEL, limits, ticks=_whole_ticks(table)),
        y=Axis(_STEP, (0.4 * float(values.min()), 2.5 * float(values.max())), is_log=True),
        width=width,
        height=round(0.75 * width),
    )


def _objective(table: pd.DataFrame, width: int) -> Figure:
    values = table["objective"]
    first, last = float(values.iloc[0]), float(values.iloc[-1])
    is_log = last > 0 and float(values.max()) > _LOG_FROM * float(values.min()) > 0
    low, high = float(values.min()), float(values.max())
    margin = 0.08 * (high - low or abs(high) or 1.0)
    limits = (low / 1.5, high * 1.5) if is_log else (low - margin, high + margin)
    return framed(
        _trace(table, "objective"),
        title="Objective: χ² of data and priors",
        subtitle=f"from {power_text(first, 6)} to {power_text(last, 6)}",
        x=Axis(_XLABEL, _limits(table), ticks=_whole_ticks(table)),
        y=Axis("objective (χ²)", limits, is_log=is_log),
        width=width,
        height=round(0.75 * width),
    )


def _losses(losses: pd.DataFrame, width: int) -> Figure:
    # The last losses scatter about the final level; those below it have no logarithm.
    above = losses[losses["excess"] > _LOWEST_EXCESS]
    last = float(losses["step"].iloc[-1])
    highest = float(above["excess"].max()) if len(above) else 1.0
    curve = line(
        above["step"],
        above["excess"],
        name="loss",
        color="mark",
        width=1.4,
        hover=_LOSS_HOVER,
        keep={"loss": above["loss"]},
    )
    return framed(
        [curve],
        title="Loss above its final level",
        subtitle=f"loss: minus the evidence lower bound; final {losses['loss'].iloc[-1]:,.6g}",
        x=Axis("step", (-0.02 * last, 1.02 * last)),
        y=Axis("loss above its final level", (_LOWEST_EXCESS, 2.0 * highest), is_log=True),
        width=width,
        height=round(0.75 * width),
    )


def _limits(table: pd.DataFrame) -> Limits:
    last = float(table["iteration"].max())
    return -0.04 * last - 0.2, 1.04 * last + 0.2


def _whole_ticks(table: pd.DataFrame) -> Ticks | None:
    last = int(table["iteration"].max())
    return [(k, str(k)) for k in range(last + 1)] if last <= _TICKS_UP_TO else None


def _last_step(rows: pd.DataFrame, tolerance: float) -> str:
    if rows.empty:
        return "no step taken"
    last = rows.iloc[-1]
    verdict = "below" if last["largest_step"] < tolerance else "above"
    # The parameter is last, because it may be cut off: source ids have nineteen digits.
    step = power_text(float(last["largest_step"]), 2)
    return f"{verdict} tolerance: {step} σ ({last['largest_parameter']})"


def _trace(rows: pd.DataFrame, column: str) -> list[Glyphs]:
    rows = rows.assign(
        step_text=[power_text(value, 2) for value in rows["largest_step"]],
        damping_text=[power_text(value, 2) for value in rows["damping"]],
    )
    size = 7.0 if len(rows) <= _MARKERS_UP_TO else 0.0
    return [
        line(rows["iteration"], rows[column], name="trace", color="mark", width=1.8),
        points(rows, "iteration", column, name="iterations", color="mark", size=size, hover=_HOVER),
    ]


def _plot(chosen: Chosen) -> Figure:
    return plot_convergence(convergence(chosen.result), loss_excess(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "convergence",
        "Convergence",
        "The largest step of any parameter over its uncertainty, and the objective or, for svi, "
        "the loss. Good: the last step is far below the tolerance.",
        OrbitWorkspace.CALIBRATION,
        90,
        _plot,
        is_wide=True,
        equation=("max |step| / σ at each iteration; objective = χ²(measurements) + χ²(priors)"),
    ),
)
