"""The numpyro model compared with the priors and the chi2 of the gauss-newton engine."""

import numpy as np
import pytest
from numpyro.infer.util import log_density

from solver.data.parameters import SOURCES
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import objective
from solver.engines.numpyro_model import (
    CALIBRATION,
    FREE_SOURCES,
    in_coordinates,
    model_input,
    plate_analysis,
)
from solver.linear.chi2 import gradient
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.linear.whitening import whitened
from solver.problem.problem import build_problem

FLAT = {"detector_x": np.inf, "focal_length": np.inf, "pitch_y": np.inf}


def density(problem, theta, sources):
    values = {**problem.layout.scatter(theta), SOURCES.name: sources}
    return float(log_density(plate_analysis, (model_input(problem),), {}, values)[0])


@pytest.mark.parametrize("widths", [{}, FLAT, {"sources": 2.0}], ids=["default", "flat", "loose"])
def test_density_equals_that_of_the_posterior(small_orbit, expansion_point, widths):
    settings = FitSettings(prior_widths=widths)
    problem = build_problem(small_orbit.data, small_orbit.instrument, settings)
    theta, sources = expansion_point
    at = gradient(problem, theta, sources)
    likelihood = -np.log(
        problem.measurements.sigma
    ).sum() - 0.5 * problem.measurements.sigma.size * np.log(2.0 * np.pi)
    expected = likelihood + problem.priors.log_normalisation()
    expected -= 0.5 * objective(problem, theta, sources, at)
    # The normalisation of gamma priors equals that of normal ones to a part in a million.
    assert density(problem, theta, sources) == pytest.approx(expected, abs=1e-3)


def test_every_group_has_a_site(problem):
    names = {group.name for group in (SOURCES, *problem.layout.groups)}
    values = {**problem.layout.scatter(np.zeros(problem.layout.size))}
    values[SOURCES.name] = np.zeros((problem.n_src, 2))
    trace = log_density(plate_analysis, (model_input(problem),), {}, values)[1]
    assert names < set(trace)


def test_density_in_other_coordinates_differs_by_their_volume(problem, expansion_point):
    reduced = eliminate_sources(accumulate(problem, *expansion_point), problem.priors)
    coordinates = whitened(reduced)
    rng = np.random.default_rng(0)
    free = {
        CALIBRATION: rng.standard_normal(problem.layout.size),
        FREE_SOURCES: rng.standard_normal((2, problem.n_src)),
    }
    found = log_density(in_coordinates, (model_input(problem), coordinates), {}, free)[0]
    placed = coordinates.place(*free.values())
    expected = density(problem, *map(np.asarray, placed)) - 0.5 * reduced.log_determinant()
    assert float(found) == pytest.approx(expected, rel=1e-12)
