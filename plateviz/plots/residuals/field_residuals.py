"""Mean residuals of each field against those of the others, as vectors on the focal plane."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, framed, message, side_by_side
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.arrows import (
    Field,
    arrows,
    automatic_scale,
    key,
    rms_length,
    round_125,
)
from plateviz.plots.elements.focal_plane import XLABEL, YLABEL, detector_outlines, field_about
from plateviz.plots.elements.style import PANEL_WIDTH
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.field_residuals import field_residuals, field_statistics
from plateviz.tables.rounded import rounded
from solver.data.instrument import Detector
from solver.units import UM_PER_MM

_TITLE = "Residuals of each field against the others"
_MARGIN, _MOST_COLUMNS = 1.07, 4
_HOVER = [
    ("at", "@{x}{0.00}, @{y}{0.00} mm, detector @{detector_id}"),
    ("x", "@{difference_x_mpix}{0.00} ± @{sigma_x_mpix}{0.00} mpix"),
    ("y", "@{difference_y_mpix}{0.00} ± @{sigma_y_mpix}{0.00} mpix"),
    ("on the sky", "@{difference_x_mas}{0.000}, @{difference_y_mas}{0.000} mas"),
    ("over their σ", "@{pull_x}{0.0}, @{pull_y}{0.0}"),
    ("measurements", "@{n}"),
]


def plot_field_residuals(
    table: pd.DataFrame, *, detectors: Sequence[Detector] = (), width: int = PANEL_WIDTH
) -> Figure:
    """Draw what the mean residuals of each field differ from those of the others, to one scale.

    Parameters
    ----------
    table : `tables.field_residuals`
    detectors : detectors to outline
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No two fields with enough measurements to compare"
        return message(_TITLE, text, width=FRAME_WIDTH, xlabel=XLABEL, ylabel=YLABEL)
    vectors = table.assign(u=table["difference_x_mpix"], v=table["difference_y_mpix"])
    # Bins may be large, and end far from their middle.
    corners = [table[["x", "y"]], *(one.corners_um() / UM_PER_MM for one in detectors)]
    area = field_about(pd.DataFrame(np.concatenate(corners), columns=["x", "y"]), _MARGIN)
    scale, rms = automatic_scale(vectors, area), rms_length(vectors)
    area = area.holding(vectors, scale)
    length = round_125(2.0 * rms)
    panels = [
        _panel(rows, detectors, area, scale, length, width, is_first=number == 0)
        for number, (_, rows) in enumerate(vectors.groupby("field_id"))
    ]
    return side_by_side(panels, columns=min(len(panels), _MOST_COLUMNS), linked="xy")


def _panel(
    rows: pd.DataFrame,
    detectors: Sequence[Detector],
    area: Field,
    scale: float,
    length: float,
    width: int,
    *,
    is_first: bool,
) -> Figure:
    found, field_id = field_statistics(rows), int(rows["field_id"].iloc[0])
    lines = [
        f"χ²/dof {found.chi2 / found.dof:.2f} (1 ± {found.scatter / found.dof:.2f})",
        f"largest {found.largest:.1f}σ (≤ {found.limit:.1f}σ)",
    ]
    return framed(
        [
            detector_outlines(detectors, "muted"),
            *arrows(rows, scale=scale, field=area, colour="mark", hover=_HOVER),
            *key(length, f"{rounded(length, 3)} mpix", scale=scale, field=area),
        ],
        title=f"Field {field_id} less others" if is_first else f"Field {field_id}",
        subtitle="\n".join(lines),
        x=Axis(XLABEL, area.x),
        y=Axis(YLABEL, area.ylim),
        width=width,
    )


# Four panels side by side in a report.
_PAGE_WIDTH = 210


def _plot(chosen: Chosen) -> Figure:
    table = field_residuals(chosen.result, chosen.instrument)
    return plot_field_residuals(table, detectors=chosen.instrument.detectors, width=_PAGE_WIDTH)


DIAGNOSTICS = (
    Diagnostic(
        "field-residuals",
        _TITLE,
        "Mean residual of each field less that of all others, in bins over the detectors, "
        "corrected for what the source positions absorb and for pointing, roll and focal length. "
        "Good: arrows without order, χ²/dof within three times its scatter by chance, and the "
        "largest below the limit that chance exceeds in one of 100 fields (both in brackets). "
        "Arrows with a pattern mean that distortion or detectors change between fields, or that "
        "the catalogue is wrong in one of them. Bins without an arrow have too few sources that "
        "are measured elsewhere too.",
        OrbitWorkspace.PATTERNS,
        26,
        _plot,
        is_wide=True,
        least_height=430,
        equation=(
            "difference = Σ w r / Σ w (1 − h) of the field, less the same of all other fields, "
            "with w = 1/s² and the share h that the source positions absorb; its variance is "
            "the sum of both 1 / Σ w (1 − h)"
        ),
    ),
)
