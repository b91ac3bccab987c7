"""The gallery: every figure that a module of `plateviz.plots` defines for a page."""

import importlib
import pkgutil
from collections.abc import Iterator
from functools import cache
from operator import attrgetter

import plateviz.plots
from plateviz.plots.diagnostic import Diagnostic
from plateviz.plots.survey_figure import SourceFigure, SurveyFigure


@cache
def diagnostics() -> tuple[Diagnostic, ...]:
    """Return the diagnostics in page order."""
    return tuple(sorted(_entries("DIAGNOSTICS"), key=attrgetter("position")))


@cache
def survey_figures() -> tuple[SurveyFigure, ...]:
    """Return the figures of a survey in page order."""
    return tuple(sorted(_entries("SURVEY_FIGURES"), key=attrgetter("position")))


@cache
def source_figures() -> tuple[SourceFigure, ...]:
    """Return the figures of one source in page order."""
    return tuple(sorted(_entries("SOURCE_FIGURES"), key=attrgetter("position")))


def _entries(name: str) -> Iterator:
    for module in pkgutil.iter_modules(plateviz.plots.__path__):
        imported = importlib.import_module(f"plateviz.plots.{module.name}")
        yield from getattr(imported, name, ())
