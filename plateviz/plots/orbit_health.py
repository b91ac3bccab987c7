"""Quality of fit against time: chi2 and the reference sources' deviations of each orbit."""

import holoviews as hv
import pandas as pd

from plateviz.plots.style import (
    FRAME_WIDTH,
    SERIES_COLOURS,
    AxisLabels,
    Limits,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.theme import theme_of
from plateviz.tables.orbit_health import orbit_health
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "χ² over its expected value, by orbit"
_X = hv.Dimension("year", label="epoch (Julian year, TCB)")
_LABELS: AxisLabels = {"xlabel": _X.label, "ylabel": "χ² / dof"}
_HOVER_CHI2 = [
    ("orbit", "@{orbit_id}"),
    ("epoch", "@{year}{0.000}"),
    ("χ² / dof", "@{chi2_per_dof}{0.0000} ± @{expected_sd}{0.0000}"),
    ("departure", "@{z}{0.0} σ"),
]
_HOVER_FAILED = [("orbit", "@{orbit_id}"), ("state", "@{state}"), ("reason", "@{message}")]
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_MARKERS = {"ra": "circle", "dec": "triangle"}


def plot_orbit_health(
    table: pd.DataFrame, *, theme: str = "light", width: int = FRAME_WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw chi2 over its degrees of freedom and the normalised deviations of each orbit.

    Orbits that failed or did not converge are marked at the bottom of the first panel.

    Parameters
    ----------
    table : `tables.orbit_health`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if not table["chi2_per_dof"].notna().any():
        return message(_TITLE, "No orbit fitted yet", theme=theme, width=width, **_LABELS)
    years = table["year"]
    margin = max(0.04 * float(years.max() - years.min()), 0.1)
    xlim = (float(years.min()) - margin, float(years.max()) + margin)
    panels = [_chi2(table, xlim, theme, width), _deviations(table, xlim, theme, width)]
    return side_by_side(panels, columns=2, linked=True)


def _chi2(table: pd.DataFrame, xlim: Limits, theme: str, width: int) -> hv.Overlay:
    fitted = table[table["chi2_per_dof"].notna()].sort_values("year", kind="stable")
    reach = 1.35 * max(
        float(fitted["expected_sd"].max()), float((fitted["chi2_per_dof"] - 1.0).abs().max())
    )
    outside = int((fitted["z"].abs() > 1.0).sum())
    return framed(
        [
            *_band(_to_edges(fitted, xlim), theme),
            _orbits(fitted, theme),
            *_marked(table, 1.0 - 0.9 * reach),
        ],
        title=_TITLE,
        subtitle=f"{_states(table)}\n{outside} of {len(fitted)} beyond ± 1σ = √(2/dof), "
        f"{0.317 * len(fitted):.1f} expected",
        theme=theme,
        width=width,
        height=round(0.6 * width),
        xlim=xlim,
        ylim=(1.0 - reach, 1.0 + reach),
        legend_columns=3,
        **_LABELS,
    )


def _to_edges(fitted: pd.DataFrame, xlim: Limits) -> pd.DataFrame:
    """Return the orbits with the first and the last one repeated at the edges of the frame."""
    ends = [fitted.head(1).assign(year=xlim[0]), fitted.tail(1).assign(year=xlim[1])]
    return pd.concat([ends[0], fitted, ends[1]], ignore_index=True)


def _band(fitted: pd.DataFrame, theme: str) -> list[hv.Element]:
    colours = theme_of(theme)
    low, high = 1.0 - fitted["expected_sd"], 1.0 + fitted["expected_sd"]
    area = hv.Area(
        (fitted["year"], low, high), _X, ["chi2_per_dof", "chi2_high"], label="expected ± 1σ"
    )
    return [
        drawn(area, color=colours.muted, alpha=0.22, line_alpha=0.0),
        drawn(hv.HLine(1.0), color=colours.line, line_width=1.2, line_dash="dashed"),
    ]


def _orbits(fitted: pd.DataFrame, theme: str) -> hv.Points:
    extra = ["orbit_id", "expected_sd", "z"]
    points = hv.Points(fitted, [_X, "chi2_per_dof"], extra, label="orbit")
    return drawn(
        points,
        color=theme_of(theme).mark,
        size=6,
        line_color=None,
        nonselection_alpha=0.2,
        tools=["hover"],
        hover_tooltips=_HOVER_CHI2,
    )


def _marked(table: pd.DataFrame, height: float) -> list[hv.Points]:
    rows = table[table["state"].isin(["failed", "not converged"])]
    if rows.empty:
        return []
    data = rows[["year", "orbit_id", "state", "message"]].assign(chi2_per_dof=height)
    points = hv.Points(
        data,
        [_X, "chi2_per_dof"],
        ["orbit_id", "state", "message"],
        label="failed or not converged",
    )
    return [
        drawn(
            points,
            color=SERIES_COLOURS[1],
            marker="x",
            size=9,
            line_width=2.0,
            tools=["hover"],
            hover_tooltips=_HOVER_FAILED,
        )
    ]


def _deviations(table: pd.DataFrame, xlim: Limits, theme: str, width: int) -> hv.Overlay:
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
        theme=theme,
        width=width,
        height=round(0.6 * width),
        xlim=xlim,
        ylim=(0.0, top),
        xlabel=_X.label,
        ylabel="normalised deviation (σ of the prior)",
        legend_columns=4,
    )


def _expected(fitted: pd.DataFrame, axis: str, number: int) -> hv.Curve:
    data = (fitted["year"], fitted[f"expected_{axis}"])
    curve = hv.Curve(data, _X, "normalised", label=f"expected, {_NAMES[axis]}")
    return drawn(curve, color=SERIES_COLOURS[number], line_width=1.4, line_dash="dashed")


def _measured(fitted: pd.DataFrame, axis: str, number: int) -> hv.Points:
    data = fitted[["year", "orbit_id"]].assign(
        normalised=fitted[f"deviation_{axis}"], expected=fitted[f"expected_{axis}"]
    )
    points = hv.Points(data, [_X, "normalised"], ["orbit_id", "expected"], label=_NAMES[axis])
    return drawn(
        points,
        color=SERIES_COLOURS[number],
        marker=_MARKERS[axis],
        size=6,
        alpha=0.85,
        line_color=None,
        nonselection_alpha=0.2,
        tools=["hover"],
        hover_tooltips=[
            ("orbit", "@{orbit_id}"),
            ("epoch", "@{year}{0.000}"),
            ("deviation", "@{normalised}{0.000}"),
            ("expected", "@{expected}{0.000}"),
        ],
    )


def _states(table: pd.DataFrame) -> str:
    counts = table["state"].value_counts()
    states = ("complete", "not converged", "failed", "missing")
    return ", ".join(f"{counts[state]} {state}" for state in states if state in counts)


def _draw(tables: SurveyTables, theme: str) -> hv.Layout | hv.Overlay:
    return plot_orbit_health(orbit_health(tables.orbits), theme=theme)


SURVEY_FIGURES = (
    SurveyFigure(
        "orbit-health",
        "Health of the orbits",
        "Chi2 over its degrees of freedom for each orbit, and the deviations of the reference "
        "sources from their priors. Good: two thirds of the orbits within the band, and "
        "deviations near their expected value, which is below 1 for a point estimate.",
        5,
        _draw,
        is_wide=True,
    ),
)
