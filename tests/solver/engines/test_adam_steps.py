"""Adam's steps: they run a few at a time, and give way to other work between these."""

import jax
import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.engines import adam_steps as module
from solver.engines.adam_steps import Stepping, adam_steps
from solver.engines.numpyro_model import model_input
from solver.engines.svi_guide import Means
from solver.errors import CancelledError
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.linear.whitening import whitened
from solver.problem.problem import build_problem
from solver.runtime.interruption import interruptible

COUNT = 2 * module._AT_ONCE


@pytest.fixture(scope="module")
def steps(small_orbit):
    """Work that makes ten steps from the catalogue."""
    problem = build_problem(small_orbit.data, small_orbit.instrument, FitSettings(engine="svi"))
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    reduced = eliminate_sources(accumulate(problem, theta, sources), problem.priors)
    unlimited = Means(*3 * (np.full(1, np.inf),))
    rates = np.geomspace(1.0, 0.1, COUNT)
    stepping = Stepping(jax.device_put(model_input(problem)), whitened(reduced), unlimited, rates)
    shape = (2, problem.n_src)
    means = Means(np.zeros_like(theta), np.zeros(shape), np.ones(shape))
    return lambda: adam_steps(stepping, means, jax.random.key(0))


def test_steps_made_a_few_at_a_time_are_those_made_at_once(steps, monkeypatch):
    """Adam's averages, the rates and the draws go on where they were."""
    means, losses = steps()
    monkeypatch.setattr(module, "_AT_ONCE", COUNT)
    at_once, losses_at_once = steps()
    assert losses.shape == (COUNT,)
    np.testing.assert_allclose(losses, losses_at_once, rtol=1e-9)
    for one, other in zip(means, at_once, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9)


def test_a_block_of_steps_gives_way_to_other_work(steps):
    asked = []

    def check():
        asked.append(0)
        if len(asked) == 2:
            raise CancelledError("other work waits")

    with interruptible(check), pytest.raises(CancelledError):
        steps()
    assert len(asked) == 2
