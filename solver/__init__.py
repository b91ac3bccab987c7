"""Plate Analysis: the solver of plateviz, with no plotting and no user interface.

The input is the pixel positions of stars on the exposures ("plates") of one satellite
orbit, and a reference catalogue. One Bayesian fit estimates every star's position, each
exposure's pointing and focal length, the optical distortion and the detectors' positions.

Importing this package enables float64 in JAX: at a right ascension of 266 deg one float32
step is about 110 mas, four orders of magnitude above the accuracy required. JAX itself is
not imported, because programs that only read results (such as the web process) must start
without it; public names load on first use.

The paper's "plate" is called an exposure here, since `numpyro.plate` is a vectorised axis;
`plate_id` is only a column name.
"""

import importlib
import os
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solver.data.instrument import Instrument as Instrument
    from solver.data.orbit import OrbitData as OrbitData
    from solver.data.parameters import PARAMETERS as PARAMETERS
    from solver.data.result import FitResult as FitResult
    from solver.data.settings import FitSettings as FitSettings
    from solver.errors import InputError as InputError
    from solver.fit import fit_orbit as fit_orbit
    from solver.io.inspect import inspect_files as inspect_files
    from solver.io.read_orbit import read_orbit as read_orbit
    from solver.io.result import read_result as read_result
    from solver.io.result import write_result as write_result
    from solver.io.survey_growth import append_orbit as append_orbit
    from solver.simulate.settings import SurveySettings as SurveySettings
    from solver.simulate.survey import simulate_survey as simulate_survey

# OpenBLAS reads this when it is loaded. Its idle threads then sleep after some microseconds
# instead of spinning, which would compete with JAX and with SciPy's own copy of OpenBLAS.
os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "14")
os.environ["JAX_ENABLE_X64"] = "1"
if "jax" in sys.modules:
    sys.modules["jax"].config.update("jax_enable_x64", True)

_PUBLIC = {
    "FitResult": "solver.data.result",
    "FitSettings": "solver.data.settings",
    "InputError": "solver.errors",
    "Instrument": "solver.data.instrument",
    "OrbitData": "solver.data.orbit",
    "PARAMETERS": "solver.data.parameters",
    "SurveySettings": "solver.simulate.settings",
    "append_orbit": "solver.io.survey_growth",
    "fit_orbit": "solver.fit",
    "inspect_files": "solver.io.inspect",
    "read_orbit": "solver.io.read_orbit",
    "read_result": "solver.io.result",
    "simulate_survey": "solver.simulate.survey",
    "write_result": "solver.io.result",
}

__all__ = [
    "PARAMETERS",
    "FitResult",
    "FitSettings",
    "InputError",
    "Instrument",
    "OrbitData",
    "SurveySettings",
    "append_orbit",
    "fit_orbit",
    "inspect_files",
    "read_orbit",
    "read_result",
    "simulate_survey",
    "write_result",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 any public name
    """Load a public name on first use, so that `import solver` stays fast."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'solver' has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
