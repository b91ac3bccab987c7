"""Pull and influence of the reference sources, against fits without their catalogue positions."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz import tables
from solver.fit import fit_orbit
from tests.plateviz.linear_stars import N_STARS, LinearStars
from tests.solver.small_orbit import make_orbit


@pytest.fixture(scope="module")
def data():
    """An orbit whose catalogue has correlated positions and proper motions."""
    data = make_orbit().data
    correlated = {"ra_dec_corr": 0.6, "pmra_pmdec_corr": 0.4}
    return replace(data, catalogue=data.catalogue.assign(**correlated))


@pytest.fixture(scope="module")
def fitted(data):
    return fit_orbit(data)


def influence_of(fit_result, problem):
    return tables.reference_influence(replace(fit_result, sources=problem.sources()))


def expected_row(place, covariance, without, covariance_without, prior):
    """Return pulls and influence by their definitions; the catalogue is at zero."""
    scatter = prior + covariance_without
    shift = place - without
    return {
        "residual_ra": -without[0],
        "residual_dec": -without[1],
        "pull_ra": -without[0] / np.sqrt(scatter[0, 0]),
        "pull_dec": -without[1] / np.sqrt(scatter[1, 1]),
        "pull": np.sqrt(without @ np.linalg.solve(scatter, without)),
        "influence": np.sqrt(shift @ np.linalg.solve(covariance, shift)),
        "shift_mas": np.hypot(*shift),
        "share": 0.5 * np.trace(covariance @ np.linalg.inv(prior)),
    }


def test_linear_problem_is_solved_without_each_prior_exactly(fit_result):
    problem = LinearStars()
    table = influence_of(fit_result, problem)
    places, covariances = problem.solve()
    for star in range(N_STARS):
        without, covariance_without = problem.solve(without=star)
        expected = expected_row(
            places[star],
            covariances[star],
            without[star],
            covariance_without[star],
            problem.prior[star],
        )
        found = table.loc[star, list(expected)].to_dict()
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 7, 19])
def test_orbit_fitted_without_a_catalogue_position_agrees(data, fitted, number):
    table = tables.reference_influence(fitted)
    star = fitted.sources[fitted.sources["is_reference"]].iloc[number]
    assert star["prior_corr"] > 0.3
    catalogue = data.catalogue.copy()
    row = catalogue["source_id"] == star["source_id"]
    # As good as no prior: 100 arcsec.
    catalogue.loc[row, ["ra_error", "dec_error"]] = 1e5
    without = fit_orbit(replace(data, catalogue=catalogue)).sources
    other = without[without["source_id"] == star["source_id"]].iloc[0]

    def covariance(one, names):
        ra, dec, correlation = one[names]
        both = correlation * ra * dec
        return np.array([(ra**2, both), (both, dec**2)])

    marginal = ["sigma_ra_marginal", "sigma_dec_marginal", "corr_marginal"]
    expected = expected_row(
        star[["offset_ra", "offset_dec"]].to_numpy(float),
        covariance(star, marginal),
        other[["offset_ra", "offset_dec"]].to_numpy(float),
        covariance(other, marginal),
        covariance(star, ["prior_sigma_ra", "prior_sigma_dec", "prior_corr"]),
    )
    found = table.set_index("id").loc[str(int(star["source_id"]))]
    assert found[list(expected)].to_dict() == pytest.approx(expected, rel=2e-3, abs=1e-4)


def test_pulls_of_noise_have_the_scatter_that_they_state(fit_result):
    pulls = pd.concat([influence_of(fit_result, LinearStars(seed)) for seed in range(40)])
    squares = (pulls["pull"] ** 2).to_numpy()
    # Two degrees of freedom: mean 2, standard deviation 2.
    assert squares.mean() == pytest.approx(2.0, abs=4.0 * 2.0 / np.sqrt(len(squares)))
    for axis in ("ra", "dec"):
        mean_square = np.mean(pulls[f"pull_{axis}"] ** 2)
        assert mean_square == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(pulls)))
    assert (squares > -2.0 * np.log(0.05)).mean() == pytest.approx(0.05, abs=0.022)


def test_wrong_catalogue_position_is_found_at_its_size(fit_result):
    wrong = np.array([6.0, -4.0])
    table = influence_of(fit_result, LinearStars(seed=3, wrong=(11, wrong)))
    assert table.index[table["is_beyond"]].tolist() == [11]
    row = table.loc[11]
    residual = row[["residual_ra", "residual_dec"]].to_numpy(float)
    sigma = residual / row[["pull_ra", "pull_dec"]].to_numpy(float)
    assert (np.abs(residual - wrong) < 4.0 * sigma).all()


def test_sources_without_information_of_their_own_are_not_known(fit_result):
    sources = LinearStars().sources()
    for axis in ("ra", "dec"):
        sources.loc[5, f"sigma_{axis}_marginal"] = sources.loc[5, f"prior_sigma_{axis}"]
    sources.loc[5, "corr_marginal"] = sources.loc[5, "prior_corr"]
    table = tables.reference_influence(replace(fit_result, sources=sources))
    assert table.loc[5, ["pull", "influence", "share"]].isna().all()
    assert not table.loc[5, "is_beyond"]
    assert table["pull"].notna().sum() == N_STARS - 1


def test_only_reference_sources_have_a_row(fit_result):
    table = tables.reference_influence(fit_result)
    references = fit_result.sources[fit_result.sources["is_reference"]]
    assert table["id"].tolist() == [str(i) for i in references["source_id"]]
    none = fit_result.sources.assign(is_reference=False)
    assert tables.reference_influence(replace(fit_result, sources=none)).empty
