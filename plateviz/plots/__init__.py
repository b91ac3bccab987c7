"""Plots: pure functions from tables to figures as plain values.

Imports `plateviz.verdict`, `plateviz.tables` and `plateviz.figures`. The figures lie in a folder
per subject. Every `plot_<noun>(table, *, options)` of a module there is exported here. It returns a
`plateviz.figures.figure.Figure`; for an empty table, one with a message. Dashboard, notebooks and
reports share them.
"""

import importlib
import pkgutil
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:

    def __getattr__(name: str) -> Callable[..., Any]: ...


def _plot_functions() -> dict[str, Callable[..., Any]]:
    modules = [
        importlib.import_module(module.name)
        for module in pkgutil.walk_packages(__path__, f"{__name__}.")
    ]
    return {
        name: value
        for module in modules
        for name, value in vars(module).items()
        if name.startswith("plot_") and value.__module__ == module.__name__
    }


_FUNCTIONS = _plot_functions()
globals().update(_FUNCTIONS, __all__=sorted(_FUNCTIONS))
