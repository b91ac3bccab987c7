"""The gallery: every diagnostic that a module of `plateviz.plots` defines."""

import importlib
import pkgutil
from functools import cache

import plateviz.plots
from plateviz.plots.diagnostic import Diagnostic


@cache
def diagnostics() -> tuple[Diagnostic, ...]:
    """Return the diagnostics in page order."""
    found: list[Diagnostic] = []
    for module in pkgutil.iter_modules(plateviz.plots.__path__):
        imported = importlib.import_module(f"plateviz.plots.{module.name}")
        found.extend(getattr(imported, "DIAGNOSTICS", ()))
    return tuple(sorted(found, key=lambda diagnostic: diagnostic.order))
