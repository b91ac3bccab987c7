"""FITS headers of a result: what made it, and the figures that its readers look for."""

import math

import numpy as np
from astropy.io import fits

from solver.data.result import FitResult
from solver.data.settings import SETTINGS, FitSettings
from solver.data.text_setting import Texts
from solver.runtime.versions import versions_of

ORIGIN = "plateviz"
FORMAT = 1

_VERSIONS = {"PLATEVIZ": "plateviz", "JAX": "jax", "NUMPY": "numpy", "ASTROPY": "astropy"}

# Keyword, value, comment. Text of any length has no comment, for it may leave no room.
Card = tuple[str, object, str]


def primary_header(result: FitResult) -> fits.Header:
    """Return the primary header: format, versions, settings, inputs and figures."""
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
        *_figures(result),
    ]
    return _header(cards)


def _settings(settings: FitSettings) -> list[Card]:
    cards = []
    for name, one in SETTINGS.items():
        if one.card:
            value = one.card_value(getattr(settings, name))
            cards.append((one.card, value, "" if isinstance(one, Texts) else one.label.lower()))
    return cards


def versions_in(primary: fits.Header) -> dict[str, str]:
    """Return the versions of the packages that made a result, from its primary header."""
    return {package: primary[key] for key, package in _VERSIONS.items() if key in primary}


def result_header(result: FitResult) -> fits.Header:
    """Return the header of RESULT, with the keywords of the published files."""
    references = result.sources[result.sources["is_reference"]]
    loss = result.trace["objective"].iloc[-1] if len(result.trace) else math.nan
    words = "std of offset over prior sigma, references"
    return _header(
        [
            *_figures(result),
            ("LOSS", loss, "final objective"),
            ("SIGMA_RA", _scatter(references["offset_ra"], references["prior_sigma_ra"]), words),
            ("SIGMA_DE", _scatter(references["offset_dec"], references["prior_sigma_dec"]), words),
        ]
    )


def _figures(result: FitResult) -> list[Card]:
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
        # A FITS header has no NaN; what is not known is left out.
        if plain is None or (isinstance(plain, float) and not math.isfinite(plain)):
            continue
        if isinstance(plain, str):
            plain = plain.encode("unicode_escape").decode("ascii")
        header[keyword] = (plain, comment)
    return header
