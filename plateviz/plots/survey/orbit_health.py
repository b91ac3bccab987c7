"""Quality of fit against time: chi2 and the reference sources' deviations of each orbit."""

import pandas as pd

from plateviz.figures.figure import (
    FRAME_WIDTH,
    Axis,
    Figure,
    Glyphs,
    Limits,
    framed,
    message,
    side_by_side,
)
from plateviz.figures.glyphs import band, horizontal, line, points
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.orbit_health import orbit_health
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "χ² over its expected value, by orbit"
_XLABEL, _YLABEL = "epoch (Julian year, TCB)", "χ² / dof"
_HOVER_CHI2 = [
    ("orbit", "@{orbit_id}"),
    ("epoch", "@{year}{0.000}"),
    ("χ² / dof", "@{chi2_per_dof}{0.0000} ± @{expected_sd}{0.0000}"),
    ("departure", "@{z}{0.0} σ"),
]
_HOVER_FAILED = [("orbit", "@{orbit_id}"), ("state", "@{state}"), ("reason", "@{message}")]
_HOVER_DEVIATION = [
    ("orbit", "@{orbit_id}"),
    ("epoch", "@{year}{0.000}"),
    ("deviation", "@{normalised}{0.000}"),
    ("expected", "@{expected}{0.000}"),
]
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_MARKERS = {"ra": "circle", "dec": "triangle"}


def plot_orbit_health(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw chi2 over its degrees of freedom and the normalised deviations of each orbit.

    Orbits that failed or did not converge are marked at the bottom of the first panel.

    Parameters
    ----------
    table : `tables.orbit_health`
    width : of each panel's frame, screen pixels
    """
    if not table["chi2_per_dof"].notna().any():
        text = "No orbit fitted yet"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    years = table["year"]
    margin = max(0.04 * float(years.max() - years.min()), 0.1)
    xlim = (float(years.min()) - margin, float(years.max()) + margin)
    panels = [_chi2(table, xlim, width), _deviations(table, xlim, width)]
    return side_by_side(panels, columns=2, linked="x")


def _chi2(table: pd.DataFrame, xlim: Limits, width: int) -> Figure:
    fitted = table[table["chi2_per_dof"].notna()].sort_values("year", kind="stable")
    reach = 1.35 * max(
        float(fitted["expected_sd"].max()), float((fitted["chi2_per_dof"] - 1.0).abs().max())
    )
    # Symmetric about 1, but chi2 is not negative.
    low, high = max(0.0, 1.0 - reach), 1.0 + reach
    outside = int((fitted["z"].abs() > 1.0).sum())
    return framed(
        [
            _band(_to_edges(fitted, xlim)),
            horizontal(1.0, name="one"),
            _orbits(fitted),
            _marked(table, low + 0.05 * (high - low)),
        ],
        title=_TITLE,
        subtitle=f"{_states(table)}\n{outside} of {len(fitted)} beyond ± 1σ = √(2/dof), "
        f"{0.317 * len(fitted):.1f} expected",
        x=Axis(_XLABEL, xlim, is_grouped=False),
        y=Axis(_YLABEL, (low, high)),
        width=width,
        height=round(0.6 * width),
        legend_columns=3,
    )


def _to_edges(fitted: pd.DataFrame, xlim: Limits) -> pd.DataFrame:
    """Return the orbits with the first and the last one repeated at the edges of the frame."""
    ends = [fitted.head(1).assign(year=xlim[0]), fitted.tail(1).assign(year=xlim[1])]
    return pd.concat([ends[0], fitted, ends[1]], ignore_index=True)


def _band(fitted: pd.DataFrame) -> Glyphs:
    low, high = 1.0 - fitted["expected_sd"], 1.0 + fitted["expected_sd"]
    return band(fitted["year"], low, high, name="band", label="expected ± 1σ")


def _orbits(fitted: pd.DataFrame) -> Glyphs:
    return points(
        fitted,
        "year",
        "chi2_per_dof",
        name="orbits",
        color="mark",
        size=6.0,
        line_width=0.0,
        hover=_HOVER_CHI2,
        label="orbit",
    )


def _marked(table: pd.DataFrame, height: float) -> Glyphs:
    rows = table[table["state"].isin(["failed", "not converged"])]
    return points(
        rows.assign(chi2_per_dof=height),
        "year",
        "chi2_per_dof",
        name="failed",
        color=SERIES_COLOURS[1],
        marker="x",
        size=9.0,
        line_width=2.0,
        hover=_HOVER_FAILED,
        label="failed or not converged",
    )


def _deviations(table: pd.DataFrame, xlim: Limits, width: int) -> Figure:
    fitted = table[table["chi2_per_dof"].notna()].sort_values("year", kind="stable")
    columns = [f"{kind}_{axis}" for kind in ("deviation", "expected") for axis in _NAMES]
    top = 1.15 * float(fitted[columns].max().max())
    return framed(
        [
            *(
                _expected(_to_edges(fitted, xlim), axis, number)
                for number, axis in enumerate(_NAMES)
            ),
            *(_measured(fitted, axis, number) for number, axis in enumerate(_NAMES)),
        ],
        title="Normalised deviation of the reference sources",
        subtitle="\n".join(
            f"{name}: mean {fitted[f'deviation_{axis}'].mean():.3f}, "
            f"expected {fitted[f'expected_{axis}'].mean():.3f}"
            for axis, name in _NAMES.items()
        ),
        x=Axis(_XLABEL, xlim, is_grouped=False),
        y=Axis("normalised deviation (σ of the prior)", (0.0, top)),
        width=width,
        height=round(0.6 * width),
        legend_columns=4,
    )


def _expected(fitted: pd.DataFrame, axis: str, number: int) -> Glyphs:
    return line(
        fitted["year"],
        fitted[f"expected_{axis}"],
        name=f"expected {axis}",
        color=SERIES_COLOURS[number],
        width=1.4,
        dash="dashed",
        label=f"expected, {_NAMES[axis]}",
    )


def _measured(fitted: pd.DataFrame, axis: str, number: int) -> Glyphs:
    named = {"normalised": fitted[f"deviation_{axis}"], "expected": fitted[f"expected_{axis}"]}
    return points(
        fitted.assign(**named),
        "year",
        "normalised",
        name=f"orbits {axis}",
        color=SERIES_COLOURS[number],
        marker=_MARKERS[axis],
        size=6.0,
        alpha=0.85,
        line_width=0.0,
        hover=_HOVER_DEVIATION,
        label=_NAMES[axis],
    )


def _states(table: pd.DataFrame) -> str:
    counts = table["state"].value_counts()
    states = ("complete", "not converged", "failed", "missing")
    return ", ".join(f"{counts[state]} {state}" for state in states if state in counts)


def _plot(tables: SurveyTables) -> Figure:
    return plot_orbit_health(orbit_health(tables.orbits))


SURVEY_FIGURES = (
    SurveyFigure(
        "orbit-health",
        "Health of the orbits",
        "Chi2 over its degrees of freedom for each orbit, and the deviations of the reference "
        "sources from their priors. Good: two thirds of the orbits within the band, and "
        "deviations near their expected value, which is below 1 for a point estimate.",
        SurveyWorkspace.VERDICT,
        5,
        _plot,
        is_wide=True,
        narrow_height=310,
        column_height=600,
        equation=(
            "χ² / dof, band 1 ± √(2 / dof); rms of (estimate − catalogue) / "
            "σ(catalogue) of the reference sources"
        ),
    ),
)
