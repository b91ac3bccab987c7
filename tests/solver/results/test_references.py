"""How large the errors of a catalogue are, from the reference stars of a solution."""

import numpy as np
import pandas as pd
import pytest
from scipy.special import chdtri

from solver.results.diagnosis import references
from solver.results.diagnosis.references import catalogue_chi2

STARS = 4000


def solution(factor, measured, shift=0.0, seed=1):
    """Return reference stars whose catalogue errors are larger than stated by a factor.

    Parameters
    ----------
    measured : uncertainty of the measurements over that of the catalogue
    shift : of the fitted positions by something else, rms along each axis, mas
    """
    rng = np.random.default_rng(seed)
    correlation = rng.uniform(-0.8, 0.8, STARS)
    prior = 0.25**2 * np.array([[[1.0, rho], [rho, 1.0]] for rho in correlation])
    noise = np.broadcast_to((0.25 * measured) ** 2 * np.diag([1.0, 0.5]), prior.shape)
    posterior = np.linalg.inv(np.linalg.inv(prior) + np.linalg.inv(noise))
    scatter = factor**2 * prior + noise + shift**2 * np.eye(2)
    deviation = np.linalg.cholesky(scatter) @ rng.standard_normal((STARS, 2, 1))
    offset = (prior @ np.linalg.solve(prior + noise, deviation))[:, :, 0]
    columns = {"source_id": np.arange(STARS), "is_reference": True}
    for i, axis in enumerate(("ra", "dec")):
        columns[f"offset_{axis}"] = offset[:, i]
        columns[f"prior_sigma_{axis}"] = np.sqrt(prior[:, i, i])
        columns[f"sigma_{axis}_marginal"] = np.sqrt(posterior[:, i, i])
    for name, matrices in (("prior_corr", prior), ("corr_marginal", posterior)):
        sigmas = np.sqrt(matrices[:, 0, 0] * matrices[:, 1, 1])
        columns[name] = matrices[:, 0, 1] / sigmas
    return pd.DataFrame(columns)


@pytest.mark.parametrize("measured", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("factor", [2.0, 15.0])
def test_factor_on_the_errors_is_found_however_good_the_measurements_are(factor, measured):
    assert catalogue_chi2(solution(factor, measured)).factor == pytest.approx(factor, rel=0.1)


def test_good_catalogue_needs_no_factor():
    found = catalogue_chi2(solution(1.0, 1.0))
    assert found.factor == pytest.approx(1.0, abs=0.1)
    assert np.mean(found.chi2) == pytest.approx(2.0, rel=0.05)


def test_shift_of_the_stars_is_no_error_of_the_catalogue():
    rows = solution(1.0, 1.0, shift=2.0)
    assert catalogue_chi2(rows).factor > 5.0
    found = catalogue_chi2(rows, 2.0)
    assert found.factor == pytest.approx(1.0, abs=0.1)
    assert np.mean(found.chi2) == pytest.approx(2.0, rel=0.05)


def test_no_reference_star_needs_no_factor():
    rows = solution(1.0, 1.0).assign(is_reference=False)
    assert catalogue_chi2(rows).factor == 1.0


def test_errors_beyond_all_measure_end_at_a_limit():
    rows = solution(1.0, 1.0)
    rows[["offset_ra", "offset_dec"]] *= 1e12
    assert catalogue_chi2(rows).factor == 1e6


# What the largest of so many chi2 exceeds in one of a thousand cases.
LIMIT = chdtri(2.0, 1e-3 / STARS)


@pytest.mark.parametrize("measured", [0.3, 3.0])
def test_no_star_stands_out_where_all_errors_are_larger(measured):
    found = catalogue_chi2(solution(5.0, measured))
    assert found.chi2.max() > LIMIT
    assert found.rescaled.max() < LIMIT
    assert np.mean(found.rescaled) == pytest.approx(2.0, rel=0.1)


def test_wrong_stars_stand_out_though_they_make_the_errors_of_all_look_larger():
    rows = solution(2.0, 1.0)
    wrong = rows.index[::10]
    rows.loc[wrong, "offset_ra"] += 40.0 * rows.loc[wrong, "prior_sigma_ra"]
    far = catalogue_chi2(rows).rescaled > LIMIT
    assert far[wrong].all()
    assert far.sum() == len(wrong)


def test_matrices_of_two_rows_are_factored_as_by_lapack():
    random = np.random.default_rng(4)
    roots = random.normal(size=(50, 2, 2))
    matrices = roots @ roots.transpose(0, 2, 1)
    # Alike along both axes, and along one axis only.
    matrices[:2] = np.eye(2), np.diag([1.0, 4.0])
    values, axes = references._eigenvectors(matrices)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(matrices), atol=1e-12)
    np.testing.assert_allclose(
        (axes * values[:, None]) @ axes.transpose(0, 2, 1), matrices, atol=1e-12
    )
    inverse = np.linalg.inv(np.linalg.cholesky(matrices))
    np.testing.assert_allclose(references._inverse_root(matrices), inverse, rtol=1e-6, atol=1e-9)
