"""Run an engine by name: one problem in, one estimate out.

Libraries that only one engine needs (numpyro, optax) are imported when that engine runs.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from solver.data.settings import FitSettings
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Iteration, find_mode
from solver.problem.problem import Problem


class Resumption(NamedTuple):
    """State from which an engine that works in blocks resumes, and a function to save later ones.

    Attributes
    ----------
    state : last state that the same fit passed to `keep`, or None
    keep : called with the state after every block
    """

    state: Any = None
    keep: Callable[[Any], None] = lambda _: None


def run_engine(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
    resumption: Resumption = Resumption(),  # noqa: B008 it never changes
) -> Estimate:
    """Solve a problem with the engine of `settings`.

    Parameters
    ----------
    progress : called after every iteration or block; an exception it raises stops the engine
    """
    return _ENGINES[settings.engine](problem, settings, progress, resumption)


def _gauss_newton(
    problem: Problem, settings: FitSettings, progress: Callable, resumption: Resumption
) -> Estimate:
    del resumption
    return Estimate(find_mode(problem, settings, progress))


def _svi(
    problem: Problem, settings: FitSettings, progress: Callable, resumption: Resumption
) -> Estimate:
    from solver.engines.svi import variational

    return variational(problem, settings, progress, resumption.state, resumption.keep)


def _nuts(
    problem: Problem, settings: FitSettings, progress: Callable, resumption: Resumption
) -> Estimate:
    from solver.engines.nuts import sample

    del resumption
    return sample(problem, settings, progress)


_ENGINES = {"gauss-newton": _gauss_newton, "svi": _svi, "nuts": _nuts}
