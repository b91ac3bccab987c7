"""Prior share of each calibration parameter."""

import holoviews as hv
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.style import FRAME_WIDTH, TICK_SIZE, AxisLabels, drawn, framed, message
from plateviz.plots.theme import theme_of
from plateviz.tables.prior_shares import prior_shares

_TITLE = "Prior share of the calibration, by group"
_LABELS: AxisLabels = {
    "xlabel": "prior share (0 is measured, 1 is assumed)",
    "ylabel": "parameter group (all its elements)",
}
_HOVER = [
    ("parameter", "@{group}, @{label}"),
    ("prior share", "@{share_text}"),
    ("value", "@{value}{0.000000} @{value_unit}"),
    ("σ marginal", "@{sigma_marginal}{0.000000} @{unit}"),
    ("σ of the prior", "@{prior_sigma}{0.000} @{unit}"),
]
_ROW_HEIGHT = 30


def plot_prior_shares(
    table: pd.DataFrame, *, theme: str = "light", width: int = FRAME_WIDTH
) -> hv.Overlay:
    """Draw the prior share of every calibration parameter, a row per group.

    Parameters
    ----------
    table : `tables.prior_shares`
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No calibration", theme=theme, width=width, **_LABELS)
    colours = theme_of(theme)
    groups = table.drop_duplicates("row")
    shown = table.assign(share_text=[_text(share) for share in table["prior_share"]])
    points = hv.Points(
        shown,
        ["prior_share", "height"],
        ["group", "label", "share_text", "value", "value_unit", "sigma_marginal", "prior_sigma"]
        + ["unit"],
    )
    half = drawn(hv.VLine(0.5), color=colours.line, line_dash="dashed", line_width=1.2)
    return framed(
        [
            half,
            drawn(
                points,
                color=colours.mark,
                size=5,
                alpha=0.75,
                line_color=None,
                tools=["hover"],
                hover_tooltips=_HOVER,
            ),
            *_largest(table, theme),
        ],
        title=_TITLE,
        subtitle=f"{len(table)} parameters, {int((table['prior_share'] > 0.5).sum())} of them "
        "more prior than measured; right: largest share of each group",
        theme=theme,
        width=width,
        height=_ROW_HEIGHT * len(groups) + 8,
        xlim=(-0.03, 1.18),
        ylim=(len(groups) - 0.45, -0.55),
        xticks=[0.0, 0.25, 0.5, 0.75, 1.0],
        yticks=[(int(row), name) for row, name in zip(groups["row"], groups["group"], strict=True)],
        **_LABELS,
    )


def _largest(table: pd.DataFrame, theme: str) -> list[hv.Element]:
    """Return the largest share of each group as a separate column without grid lines."""
    rows, colours = table.groupby("row"), theme_of(theme)
    largest, is_flat = rows["prior_share"].max(), rows["prior_sigma"].min() == float("inf")
    texts = ["flat" if is_flat[row] else _text(share) for row, share in largest.items()]
    ground = hv.Rectangles([(1.02, -0.55, 1.18, len(largest) - 0.45)])
    labels = hv.Labels(([1.165] * len(largest), largest.index, texts))
    return [
        drawn(ground, color=colours.background, line_color=None),
        drawn(labels, text_color=colours.text, text_font_size=TICK_SIZE, text_align="right"),
    ]


def _text(share: float) -> str:
    return f"{share:.2f}" if share >= 0.005 or share == 0.0 else f"{share:.0e}"


def _draw(chosen: Chosen, theme: str) -> hv.Overlay:
    return plot_prior_shares(prior_shares(chosen.result), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "prior-shares",
        "Prior share of the calibration",
        "The marginal variance of each parameter over its prior variance. Good: near 0, which "
        "is measured; near 1 is assumed. A share of a quarter in each of four detectors means "
        "that their common part is assumed.",
        81,
        _draw,
    ),
)
