"""plateviz: run Plate Analysis on an orbit, and see whether to trust the solution.

In a notebook, `plateviz.open` opens a survey, an orbit or a solution, and `plateviz.simulate`
simulates a survey. The import is fast: public names load on first use.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plateviz.notebook.opening import open as open
    from plateviz.notebook.opening import simulate as simulate
    from solver.errors import FitError as FitError
    from solver.errors import InputError as InputError

_PUBLIC = {
    "FitError": "solver.errors",
    "InputError": "solver.errors",
    "open": "plateviz.notebook.opening",
    "simulate": "plateviz.notebook.opening",
}

__all__ = ["FitError", "InputError", "open", "simulate"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 any public name
    """Load a public name on first use."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'plateviz' has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
