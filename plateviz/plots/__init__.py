"""Figures: pure functions from the tables of `plateviz.tables` to HoloViews objects.

Imports `plateviz.tables`. Every `plot_<noun>(table, *, options)` of a module in this folder is
exported here. It returns an object for the Bokeh backend; for an empty table, an empty figure with
a title. Dashboard, notebooks and reports share them.
"""

import importlib
import pkgutil
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:

    def __getattr__(name: str) -> Callable[..., Any]: ...


def _plot_functions() -> dict[str, Callable[..., Any]]:
    modules = [
        importlib.import_module(f"{__name__}.{module.name}")
        for module in pkgutil.iter_modules(__path__)
    ]
    return {
        name: value
        for module in modules
        for name, value in vars(module).items()
        if name.startswith("plot_") and value.__module__ == module.__name__
    }


_FUNCTIONS = _plot_functions()
globals().update(_FUNCTIONS, __all__=sorted(_FUNCTIONS))
