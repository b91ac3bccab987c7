"""FITS headers of a result: provenance, settings and summary values."""

import math

import numpy as np
from astropy.io import fits

from solver.data.result import FitResult
from solver.data.settings import SETTINGS, FitSettings
from solver.data.text_setting import Texts
from solver.runtime.versions import versions_of

ORIGIN = "plateviz"
# 2: SUMMARY has the instrument, which readers of 1 do not know.
FORMAT = 2

_VERSIONS = {"PLATEVIZ": "plateviz", "JAX": "jax", "NUMPY": "numpy", "ASTROPY": "astropy"}

# Keyword, value, comment. Long text has no comment, since it may leave no room for one.
Card = tuple[str, object, str]


def primary_header(result: FitResult) -> fits.Header:
    """Return the primary header: format, versions, settings, inputs and summary values."""
    inputs = list(result.provenance.items())
    versions = versions_of(_VERSIONS.values())
    cards: list[Card] = [
        ("ORIGIN", ORIGIN, "program that wrote this file"),
        ("FORMAT", FORMAT, "version of this layout"),
        *(
            (keyword, versions[package], f"version of {package}")
            for keyword, package in _VERSIONS.items()
        ),
        ("INPUT", inputs[0][0] if inputs else None, ""),
        ("REFCAT", inputs[1][0] if len(inputs) > 1 else None, ""),
    ]
    for number, (name, digest) in enumerate(inputs, 1):
        cards += [
            (f"INFILE{number}", name, ""),
            (f"INHASH{number}", digest, ""),
        ]
    cards += [
        *_settings(result.settings),
        ("NITER", int(result.trace["iteration"].max()) if len(result.trace) else 0, "iterations"),
        *_verdict(result),
        *_summary_cards(result),
    ]
    return _header(cards)


def _verdict(result: FitResult) -> list[Card]:
    verdict = result.summary.get("verdict")
    if verdict is None:
        return []
    return [
        ("VERDICT", verdict["state"], "good, warn or bad"),
        ("VERDTEXT", verdict["headline"], ""),
    ]


def _settings(settings: FitSettings) -> list[Card]:
    cards = []
    for name, one in SETTINGS.items():
        if one.card:
            value = one.card_value(getattr(settings, name))
            cards.append((one.card, value, "" if isinstance(one, Texts) else one.label.lower()))
    return cards


def versions_in(primary: fits.Header) -> dict[str, str]:
    """Return the versions of the packages used for a result, from its primary header."""
    return {package: primary[key] for key, package in _VERSIONS.items() if key in primary}


def result_header(result: FitResult) -> fits.Header:
    """Return the header of the HDU RESULT, with the keywords of the published files."""
    references = result.sources[result.sources["is_reference"]]
    loss = result.trace["objective"].iloc[-1] if len(result.trace) else math.nan
    comment = "std of offset over prior sigma, references"
    return _header(
        [
            *_summary_cards(result),
            ("LOSS", loss, "final objective"),
            ("SIGMA_RA", _scatter(references["offset_ra"], references["prior_sigma_ra"]), comment),
            (
                "SIGMA_DE",
                _scatter(references["offset_dec"], references["prior_sigma_dec"]),
                comment,
            ),
        ]
    )


def _summary_cards(result: FitResult) -> list[Card]:
    sigma_x, sigma_y = result.residuals["sx"].mean(), result.residuals["sy"].mean()
    return [
        ("OBSTIME", result.exposures["obstime"].mean(), "mean epoch, MJD (TCB)"),
        ("SIGMA_X", sigma_x, "[pix] mean measurement uncertainty in x"),
        ("SIGMA_Y", sigma_y, "[pix] mean measurement uncertainty in y"),
        ("SIGMA", (sigma_x + sigma_y) / 2.0, "[pix] mean measurement uncertainty"),
    ]


def _scatter(offset: np.ndarray, sigma: np.ndarray) -> float:
    return float(np.std(np.asarray(offset) / np.asarray(sigma))) if len(offset) else math.nan


def _header(cards: list[Card]) -> fits.Header:
    header = fits.Header()
    for keyword, value, comment in cards:
        plain = value.item() if isinstance(value, np.generic) else value
        # A FITS header cannot hold NaN; unknown values are omitted.
        if plain is None or (isinstance(plain, float) and not math.isfinite(plain)):
            continue
        if isinstance(plain, str):
            plain = plain.encode("unicode_escape").decode("ascii")
        header[keyword] = (plain, comment)
    return header
