from dataclasses import replace

import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.data.survey_schema import ERROR_BUDGET, HISTORY, N_DRAWS, SHARED_ERRORS
from solver.fit import OrbitFitter
from solver.linear.covariances import covariances
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.results.shared_errors import (
    _drawn_errors,
    draws_of,
    error_budget_table,
    shared_error_table,
)

MANY = 400


def equations_of(problem):
    return accumulate(problem, np.zeros(problem.layout.size), np.zeros((problem.n_src, 2)))


@pytest.fixture
def budget(problem, reduced):
    return error_budget_table(problem, reduced, covariances(reduced))


def test_budget_sums_to_the_marginal_variance(problem, reduced, budget):
    assert list(budget.columns) == ERROR_BUDGET.names
    marginal = covariances(reduced).source
    for i, axis in enumerate(("ra", "dec")):
        total = budget[f"sigma_{axis}_noise"] ** 2 + budget[f"sigma_{axis}_catalogue"] ** 2
        np.testing.assert_allclose(total, marginal[:, i, i], rtol=1e-9)


def test_draws_scatter_as_in_the_budget(problem, reduced, budget):
    table = shared_error_table(problem, reduced, FitSettings())
    assert list(table.columns) == SHARED_ERRORS.names
    found = draws_of(table).std(axis=1)
    # All sources share the errors of the same reference sources, so they are not independent.
    ratio = np.median(found[:, 0] / budget["sigma_ra_catalogue"])
    assert ratio == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * N_DRAWS))


def test_many_draws_have_the_covariance_of_the_catalogue(problem, reduced, budget, monkeypatch):
    monkeypatch.setattr("solver.results.shared_errors.N_DRAWS", MANY)
    names = ["source_id", *(f"{a}_{d:03d}" for a in ("ra", "dec") for d in range(MANY))]

    class Wide:
        def __init__(self):
            self.names = names

    monkeypatch.setattr("solver.results.shared_errors.SHARED_ERRORS", Wide())
    drawn = draws_of(shared_error_table(problem, reduced, FitSettings()))
    # Only reference sources have drawn errors; the wide priors of the others hardly contribute.
    for i, axis in enumerate(("ra", "dec")):
        ratio = (drawn[:, :, i].std(axis=1) / budget[f"sigma_{axis}_catalogue"]) ** 2
        assert ratio.mean() == pytest.approx(1.0, abs=0.2)


def test_source_with_a_tight_prior_has_the_errors_of_the_catalogue(problem):
    tight = replace(
        problem, priors=problem.priors._replace(precision=1e12 * problem.priors.precision)
    )
    reduced = eliminate_sources(equations_of(problem), tight.priors)
    drawn = draws_of(shared_error_table(tight, reduced, FitSettings()))
    is_reference = problem.sources["is_reference"].to_numpy(bool)
    sigma = np.sqrt(np.linalg.inv(problem.priors.precision)[is_reference][:, 0, 0])
    spread = drawn[is_reference, :, 0].std(axis=1) / sigma
    assert spread.mean() == pytest.approx(1.0, abs=0.1)
    assert np.abs(drawn[~is_reference]).max() < 1e-3


def test_drawn_errors_do_not_depend_on_the_other_sources(problem):
    """The errors depend only on the ID of the source, so they are the same in every orbit."""
    subset = replace(problem, sources=problem.sources.iloc[::2])
    full, of_subset = (_drawn_errors(p.sources, p.epoch) for p in (problem, subset))
    np.testing.assert_array_equal(full[:, ::2], of_subset)


def test_wider_priors_scale_the_errors(problem, reduced):
    default = draws_of(shared_error_table(problem, reduced, FitSettings()))
    doubled = draws_of(
        shared_error_table(problem, reduced, FitSettings(prior_widths={"sources": 2.0}))
    )
    np.testing.assert_allclose(doubled, 2.0 * default, rtol=1e-6)


def test_history_has_the_columns_of_the_schema(small_orbit):
    fitter = OrbitFitter(small_orbit.data, small_orbit.instrument)
    result = fitter.fit(FitSettings())
    history = fitter.history(result)
    assert list(history.columns) == [*HISTORY.names, *SHARED_ERRORS.names[1:]]
    deviation = history["offset_ra"] - history["true_offset_ra"]
    assert (np.abs(deviation) < 6.0 * history["sigma_ra_marginal"]).all()


def test_history_is_relative_to_the_catalogue_where_the_priors_are_shifted(small_orbit):
    """All positions follow a shift of the catalogue; the truth stays where it is."""
    fitter = OrbitFitter(small_orbit.data, small_orbit.instrument)
    shifted = FitSettings(prior_shifts={"sources[ra]": 5.0})
    plain, moved = (fitter.history(fitter.fit(one)) for one in (FitSettings(), shifted))
    change = moved["offset_ra"] - plain["offset_ra"]
    assert change.median() == pytest.approx(5.0, abs=0.1)
    for name in ("true_offset_ra", "true_offset_dec"):
        np.testing.assert_allclose(moved[name], plain[name], atol=1e-3)
