import numpy as np
import pytest

from solver.linear import chi2 as objective


@pytest.fixture
def traces(monkeypatch):
    """A list that grows by one whenever JAX traces the model anew for its gradient."""
    found, half_chi2 = [], objective.half_chi2

    def counted(*arguments):
        found.append(len(arguments))
        return half_chi2(*arguments)

    monkeypatch.setattr(objective, "half_chi2", counted)
    objective._of_chunk.clear_cache()
    yield found
    objective._of_chunk.clear_cache()


def test_gradient_is_traced_once_for_all_chunks(problem, traces):
    """Each trace is a compilation, or a second of a short run."""
    assert len(problem.measurements.tiles.measured) > 1
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    objective.gradient(problem, theta, sources)
    assert len(traces) == 1


def test_gradient_is_of_numpy_in_double_precision(problem):
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    _, by_theta, by_source = objective.gradient(problem, theta, sources)
    assert type(by_theta) is type(by_source) is np.ndarray
    assert by_theta.dtype == by_source.dtype == np.float64
