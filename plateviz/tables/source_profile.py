"""Tables of one source of a run (numbers, motion, orbits), and the list of sources."""

import math

import numpy as np
import pandas as pd

from plateviz.tables.headings import MOTION, ORBITS_OF_SOURCE, SOURCES_OF_RUN, in_words
from plateviz.tables.labels import dates, id_strings
from plateviz.tables.rounded import with_minus_signs
from plateviz.tables.source_track import catalogue_motion
from plateviz.tables.sources import ordered_by_class
from plateviz.tables.summary import SummaryItem
from solver.data.survey_schema import MOTION_PARAMETERS

_NAMES = {
    "ra": ("Δα cos δ at {epoch:.2f}", "mas"),
    "dec": ("Δδ at {epoch:.2f}", "mas"),
    "parallax": ("parallax", "mas"),
    "pmra": ("proper motion in α cos δ", "mas/yr"),
    "pmdec": ("proper motion in δ", "mas/yr"),
}
# Decimals of a number whose uncertainty is not known, which are the most that any has.
_MOST_DECIMALS = 3
_NO_SCATTER = "Too few orbits: the motion fits all positions exactly, or is not fitted."
_FIGURES = ("fit", "sigma_noise", "sigma_catalogue", "sigma", "true", "pull")


def source_class(history: pd.DataFrame) -> str:
    """Return the class of a source from its rows of `survey_schema.HISTORY`."""
    return str(ordered_by_class(history)["source_class"].iloc[0])


def source_strip(history: pd.DataFrame, motion: pd.Series | None) -> list[SummaryItem]:
    """Return the summary numbers of one source.

    Parameters
    ----------
    history : `survey_schema.HISTORY` of the source, at least one row
    motion : its row of `survey_schema.MOTIONS`, or None until the orbits are gathered
    """
    measurements = f"{history['n_obs'].sum():,}"
    if motion is None:
        return [_plain("Orbits", f"{len(history):,}"), _plain("Measurements", measurements)]
    return [
        _plain("Orbits", f"{len(history):,} (in {motion['span']:.2f} yr)"),
        _plain("Measurements", measurements),
        _parallax(history, motion),
        _separation(motion, "catalogue"),
        *([] if math.isnan(motion["rms_truth_2d"]) else [_separation(motion, "truth")]),
        *(_scatter(motion, axis, symbol) for axis, symbol in (("ra", "α"), ("dec", "δ"))),
        _chi2(motion),
    ]


def _plain(label: str, value: str, hint: str = "of the source in this run") -> SummaryItem:
    return SummaryItem(label, with_minus_signs(value), hint, "neutral")


def _parallax(history: pd.DataFrame, motion: pd.Series) -> SummaryItem:
    value = catalogue_motion(history)[0] + motion["fit_parallax"]
    hint = (
        "Fitted parallax and its uncertainty, from the noise and from the errors of the "
        "reference catalogue. The table Motion has its parts, and what it is off the catalogue."
    )
    if math.isnan(value):
        return _plain("Parallax", "–", "Too few orbits, or too close in time, to determine it.")
    return _plain("Parallax", f"{value:.3f} mas (± {motion['sigma_parallax']:.3f} mas)", hint)


def _separation(motion: pd.Series, other: str) -> SummaryItem:
    ra, dec = motion[f"rms_{other}_ra"], motion[f"rms_{other}_dec"]
    hint = (
        f"Rms separation of the orbits' positions from the {other} at their epochs; "
        f"{ra:,.3f} mas in α cos δ and {dec:,.3f} mas in δ."
    )
    return _plain(f"Rms from the {other}", f"{motion[f'rms_{other}_2d']:,.3f} mas", hint)


def _scatter(motion: pd.Series, axis: str, symbol: str) -> SummaryItem:
    found, expected = motion[f"scatter_{axis}"], motion[f"expected_scatter_{axis}"]
    hint = (
        "Standard deviation of the orbits' positions about the fitted motion, and the "
        "value that their noise predicts."
    )
    label = f"Scatter in {symbol}"
    if math.isnan(found):
        return _plain(label, "–", _NO_SCATTER)
    return _plain(label, f"{found:.3f} mas (expected {expected:.3f} mas)", hint)


def _chi2(motion: pd.Series) -> SummaryItem:
    dof, label = int(motion["dof"]), "χ² of the motion"
    if dof <= 0 or math.isnan(motion["chi2"]):
        return _plain(label, "–", _NO_SCATTER)
    hint = f"Weighted by the noise only. Expected {dof} ± {math.sqrt(2.0 * dof):.1f}."
    return _plain(label, f"{motion['chi2']:.1f} (dof {dof})", hint)


def motion_table(history: pd.DataFrame, motion: pd.Series) -> pd.DataFrame:
    """Return the fitted motion of a source, also relative to its catalogue entry and its truth.

    Parameters
    ----------
    history : `survey_schema.HISTORY` of the source
    motion : a row of `survey_schema.MOTIONS`

    Returns
    -------
    A row per parameter: `parameter`, `unit`, `value` (of parallax and proper motion), `fit`,
    `sigma_noise`, `sigma_catalogue`, `sigma`, `true` and `pull`; `fit` and `true` are relative
    to the catalogue. NaN where there is none
    """
    catalogue = (math.nan, math.nan, *catalogue_motion(history))
    rows = []
    for name, listed in zip(MOTION_PARAMETERS, catalogue, strict=True):
        label, unit = _NAMES[name]
        figures = {figure: float(motion[f"{figure}_{name}"]) for figure in _FIGURES}
        figures = {"value": listed + figures["fit"], **figures}
        rows.append({"parameter": label.format(epoch=motion["epoch"]), "unit": unit, **figures})
    return pd.DataFrame(rows)


def motion_in_words(table: pd.DataFrame) -> pd.DataFrame:
    """Return a `motion_table` for display, with the decimals that each uncertainty justifies.

    Parameters
    ----------
    table : in any unit
    """
    decimals = [_decimals(sigma) for sigma in table["sigma"]]
    return in_words(table, MOTION, dict.fromkeys(("value", *_FIGURES[:-1]), decimals))


def source_orbits(history: pd.DataFrame) -> pd.DataFrame:
    """Return the orbits of one source for display, a row each.

    Parameters
    ----------
    history : `survey_schema.HISTORY` of the source

    Returns
    -------
    `orbit_id`, `date` as text, `n_obs`; offset from the catalogue, deviation from the truth
    (NaN without one) and marginal sigma in both coordinates, mas; `chi2_per_dof`
    """
    dof = history["dof"].to_numpy()
    return history.assign(
        date=dates(history["epoch"]),
        deviation_ra=history["offset_ra"] - history["true_offset_ra"],
        deviation_dec=history["offset_dec"] - history["true_offset_dec"],
        chi2_per_dof=history["chi2"] / np.where(dof > 0, dof, np.nan),
    )[list(ORBITS_OF_SOURCE)]


def source_list(counts: pd.DataFrame) -> pd.DataFrame:
    """Return the sources of a run, those with the most orbits and measurements first.

    Parameters
    ----------
    counts : `source_id`, `is_reference`, `is_artificial`, `n_orbits`, `n_obs`

    Returns
    -------
    `id` as text, `source_class`, `n_orbits`, `n_obs`
    """
    table = ordered_by_class(counts).sort_values(
        ["n_orbits", "n_obs"], ascending=False, kind="stable", ignore_index=True
    )
    return table.assign(id=id_strings(table["source_id"]))[list(SOURCES_OF_RUN)]


def _decimals(sigma: float) -> int:
    """Return the decimals of an uncertainty with two significant digits."""
    if not (math.isfinite(sigma) and sigma > 0.0):
        return _MOST_DECIMALS
    return min(_MOST_DECIMALS, max(0, 1 - math.floor(math.log10(sigma))))
