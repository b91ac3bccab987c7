"""Figure of the tests of a solution, with what chance makes of as many."""

import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, framed, message
from plateviz.figures.glyphs import band, points, vertical
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.verdict.solution_tests import solution_tests

_TITLE = "Tests of the solution"
_XLABEL, _YLABEL = "significance (σ)", "test (the most significant)"
_HOVER = [
    ("test", "@{name}"),
    ("significance", "@{sigma}{0.0} σ"),
    ("statistic", "@{statistic}{0.000} (expected @{expected}{0.000} ± @{scatter}{0.000})"),
    ("rms of the pattern", "@{size_nm}{0.0} nm"),
]
_ROW_HEIGHT = 22
_LEAST_RANGE = 6.0


def plot_solution_tests(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the significance of each test, and up to which chance explains it.

    Parameters
    ----------
    table : `verdict.solution_tests`
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No tests", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    total = int(table["total"].iloc[0])
    limit, count = float(table["limit"].iloc[0]), int(table["total_found"].iloc[0])
    cut = f"; the first {len(table)} are shown" if len(table) < total else ""
    most = max(1.08 * float(table["sigma"].max()), _LEAST_RANGE)
    low, high = len(table) - 0.4, -0.6
    shown = {
        name: points(
            table[table["is_found"] == is_found],
            "sigma",
            "row",
            name=name,
            color=colour,
            size=9,
            hover=_HOVER,
        )
        for name, is_found, colour in (("by chance", False, "muted"), ("found", True, "mark"))
    }
    ticks = [(float(row), name) for row, name in zip(table["row"], table["name"], strict=True)]
    return framed(
        [
            band([0.0, limit], [high, high], [low, low], name="chance"),
            vertical(limit, name="limit"),
            *shown.values(),
        ],
        title=_TITLE,
        subtitle=f"{count} of {total} find more than chance{cut}; band: what chance explains, "
        f"up to {limit:.1f} σ",
        x=Axis(_XLABEL, (0.0, most)),
        y=Axis(_YLABEL, (low, high), ticks=ticks),
        width=width,
        height=_ROW_HEIGHT * len(table) + 8,
    )


def _plot(chosen: Chosen) -> Figure:
    return plot_solution_tests(solution_tests(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "solution-tests",
        _TITLE,
        "The tests that the verdict rests on: patterns of the residuals on the focal plane and in "
        "time, their size, and the reference stars. Good: all within the band. A pattern overlaps "
        "with others; the one furthest off is the likely cause, and the verdict names it.",
        OrbitWorkspace.PATTERNS,
        27,
        _plot,
        needs_verdict=True,
        # A row of the card's height for the name of each test.
        least_height=430,
        narrow_height=580,
        equation="σ of a normal value with the same probability by chance",
    ),
)
