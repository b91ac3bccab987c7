"""The engines by name: one problem in, one estimate out, whichever is asked for.

What only one of them needs (numpyro, optax) is loaded when that one is asked for.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from solver.data.settings import FitSettings
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Iteration, find_mode
from solver.problem.problem import Problem


class Resumption(NamedTuple):
    """Where an engine that works in blocks is to go on, and who keeps what it has done.

    Attributes
    ----------
    state : what `keep` was given last by a run of the same problem, or None
    keep : given the state after every block
    """

    state: Any = None
    keep: Callable[[Any], None] = lambda _: None


def run_engine(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
    resumption: Resumption = Resumption(),  # noqa: B008 it never changes
) -> Estimate:
    """Solve a problem with the engine that `settings` name.

    Parameters
    ----------
    progress : called after every iteration or block; what it raises stops the engine
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
