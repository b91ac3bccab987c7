"""The gallery: every figure that a module in `plateviz.plots` defines for a page."""

import importlib
import pkgutil
from collections.abc import Iterator
from functools import cache
from operator import attrgetter

import plateviz.plots
from plateviz.plots.diagnostic import Diagnostic
from plateviz.plots.survey_figure import SourceFigure, SurveyFigure

# Figures of one position stand in the order of their names.
_PLACE = attrgetter("position", "name")


@cache
def diagnostics() -> tuple[Diagnostic, ...]:
    """Return the diagnostics in page order."""
    return tuple(sorted(_entries("DIAGNOSTICS"), key=_PLACE))


@cache
def survey_figures() -> tuple[SurveyFigure, ...]:
    """Return the figures of a survey in page order."""
    return tuple(sorted(_entries("SURVEY_FIGURES"), key=_PLACE))


@cache
def source_figures() -> tuple[SourceFigure, ...]:
    """Return the figures of one source in page order."""
    return tuple(sorted(_entries("SOURCE_FIGURES"), key=_PLACE))


def _entries(name: str) -> Iterator:
    for module in pkgutil.walk_packages(plateviz.plots.__path__, "plateviz.plots."):
        yield from getattr(importlib.import_module(module.name), name, ())
