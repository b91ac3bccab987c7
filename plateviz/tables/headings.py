"""Titles and number formats of the columns of tables on pages and in reports."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import pandas as pd

from plateviz.tables.rounded import with_minus_signs

_ALPHA, _DELTA = "Reference sources, α", "Reference sources, δ"
_CATALOGUE, _TRUTH, _SIGMA = "− catalogue, mas", "− truth, mas", "marginal σ, mas"
_PRIOR = "minus prior, mas"
_STANDARDISED = "rms residual over its σ"


class Heading(NamedTuple):
    """How a column is shown: its title, its number format, and the title of its group."""

    title: str
    format: str = ""
    group: str = ""


ORBITS_OF_RUN: Mapping[str, Heading] = {
    "orbit_id": Heading("orbit", "0"),
    "date": Heading("epoch (TCB)"),
    "status": Heading("status"),
    "verdict": Heading("verdict"),
    "chi2_per_dof": Heading("χ²/dof", "0,0.000"),
    "normalised_deviation_ra": Heading("deviation/σ", "0,0.000", _ALPHA),
    "expected_normalised_deviation_ra": Heading("expected", "0,0.000", _ALPHA),
    "normalised_deviation_dec": Heading("deviation/σ", "0,0.000", _DELTA),
    "expected_normalised_deviation_dec": Heading("expected", "0,0.000", _DELTA),
    "n_measurements": Heading("measurements", "0,0"),
    "n_sources": Heading("sources", "0,0"),
    "n_reference": Heading("reference", "0,0"),
    "iterations": Heading("iterations", "0"),
    "seconds": Heading("time (s)", "0.0"),
    "message": Heading("message"),
}
MOTION: Mapping[str, Heading] = {
    "parameter": Heading("parameter"),
    "unit": Heading("unit"),
    "value": Heading("fitted", "0,0.000"),
    "fit": Heading("fitted − catalogue", "0,0.000"),
    "sigma_noise": Heading("σ noise", "0,0.000"),
    "sigma_catalogue": Heading("σ from references", "0,0.000"),
    "sigma": Heading("σ", "0,0.000"),
    "true": Heading("truth − catalogue", "0,0.000"),
    "pull": Heading("pull", "0,0.000"),
}
ORBITS_OF_SOURCE: Mapping[str, Heading] = {
    "orbit_id": Heading("orbit", "0"),
    "date": Heading("epoch (TCB)"),
    "n_obs": Heading("measurements", "0,0"),
    "offset_ra": Heading("Δα cos δ", "0,0.000", _CATALOGUE),
    "offset_dec": Heading("Δδ", "0,0.000", _CATALOGUE),
    "deviation_ra": Heading("Δα cos δ", "0,0.000", _TRUTH),
    "deviation_dec": Heading("Δδ", "0,0.000", _TRUTH),
    "sigma_ra_marginal": Heading("α cos δ", "0,0.000", _SIGMA),
    "sigma_dec_marginal": Heading("δ", "0,0.000", _SIGMA),
    "chi2_per_dof": Heading("χ²/dof", "0,0.000"),
}
SELECTED_SOURCES: Mapping[str, Heading] = {
    "id": Heading("source"),
    "source_class": Heading("class"),
    "n_orbits": Heading("orbits", "0"),
    "n_obs": Heading("measurements", "0,0"),
    "ra": Heading("α (deg)", "0.000000"),
    "dec": Heading("δ (deg)", "0.000000"),
    "offset_ra": Heading("Δα cos δ", "0,0.000", _PRIOR),
    "offset_dec": Heading("Δδ", "0,0.000", _PRIOR),
    "sigma_ra_marginal": Heading("α cos δ", "0,0.000", _SIGMA),
    "sigma_dec_marginal": Heading("δ", "0,0.000", _SIGMA),
    "chi2_per_dof": Heading("χ²/dof", "0.00"),
}
SELECTED_EXPOSURES: Mapping[str, Heading] = {
    "field_id": Heading("field", "0"),
    "plate_id": Heading("exposure", "0"),
    "minutes": Heading("since the first (min)", "0.00"),
    "n_obs": Heading("measurements", "0,0"),
    "chi2_per_dof": Heading("χ²/dof", "0.00"),
}
SELECTED_DETECTORS: Mapping[str, Heading] = {
    "detector_id": Heading("detector", "0"),
    "n_obs": Heading("measurements", "0,0"),
    "rms_x": Heading("x", "0,0.000", _STANDARDISED),
    "rms_y": Heading("y", "0,0.000", _STANDARDISED),
}
CHANGES: Mapping[str, Heading] = {
    "what": Heading(""),
    "a": Heading("A"),
    "b": Heading("B"),
    "change": Heading("B minus A"),
}
SOURCES_OF_RUN: Mapping[str, Heading] = {
    "id": Heading("source"),
    "source_class": Heading("class"),
    "n_orbits": Heading("orbits", "0"),
    "n_obs": Heading("measurements", "0,0"),
}


def in_words(
    table: pd.DataFrame,
    headings: Mapping[str, Heading],
    decimals: Mapping[str, Sequence[int]] = MappingProxyType({}),
) -> pd.DataFrame:
    """Return a table for display: titles as column names, numbers formatted as text.

    Parameters
    ----------
    headings : column -> how it is shown; other columns, and columns without any value, are
        left out
    decimals : column -> decimals of each of its rows, if they are not those of its format
    """
    shown = {}
    for name, heading in headings.items():
        title = f"{heading.group}: {heading.title}" if heading.group else heading.title
        own = [len(heading.format.partition(".")[2])] * len(table)
        cells = zip(table[name], decimals.get(name, own), strict=True)
        texts = [_text(value, heading.format, n) for value, n in cells]
        shown[title] = pd.Series(texts, index=table.index, dtype=object)
    return pd.DataFrame({title: values for title, values in shown.items() if (values != "").any()})


def _text(value: Any, form: str, decimals: int) -> str:  # noqa: ANN401 a cell of any type
    if pd.isna(value):
        return ""
    if not form:
        return str(value)
    thousands = "," if "," in form else ""
    return with_minus_signs(f"{float(value):{thousands}.{decimals}f}")
