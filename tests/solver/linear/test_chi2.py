import numpy as np
import pytest

from solver.linear import chi2


@pytest.fixture
def traces(monkeypatch):
    """A list with one entry for each time that JAX traces the model for its gradient."""
    found, half_chi2 = [], chi2.half_chi2

    def counted(*arguments):
        found.append(len(arguments))
        return half_chi2(*arguments)

    monkeypatch.setattr(chi2, "half_chi2", counted)
    chi2._value_and_gradient.clear_cache()
    yield found
    chi2._value_and_gradient.clear_cache()


def test_gradient_is_traced_once_for_all_chunks(problem, traces):
    """Each trace causes a compilation, which takes about a second of a short run."""
    assert len(problem.measurements.tiles.measured) > 1
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    chi2.gradient(problem, theta, sources)
    assert len(traces) == 1


def test_gradient_is_returned_as_numpy_arrays_in_double_precision(problem):
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    _, by_theta, by_source = chi2.gradient(problem, theta, sources)
    assert type(by_theta) is type(by_source) is np.ndarray
    assert by_theta.dtype == by_source.dtype == np.float64
