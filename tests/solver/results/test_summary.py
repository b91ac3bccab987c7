import numpy as np
import pandas as pd
import pytest

from solver.results.summary import MIN_OBS, class_members, truth_summary


def test_counts_equal_those_of_the_tables(small_orbit, result):
    summary, sources = result.summary, result.sources
    assert summary["n_measurements"] == len(small_orbit.data.measurements)
    assert summary["n_sources"] == len(sources)
    assert summary["n_reference"] == sources["is_reference"].sum()
    assert summary["n_exposures"] == len(small_orbit.data.exposures)
    assert summary["n_parameters"] == 2 * len(sources) + len(result.calibration)
    assert summary["orbit"] == small_orbit.data.orbit_id
    assert summary["epoch_mjd"] == pytest.approx(small_orbit.data.exposures["obstime"].mean())


def test_documented_keys_are_present(result):
    expected = {"converged", "reason", "engine", "iterations", "n_measurements", "n_sources"}
    expected |= {"n_reference", "chi2_per_dof", "seconds"}
    assert expected <= set(result.summary)
    assert set(result.summary["seconds"]) >= {"prepare", "fit"}


def test_values_are_plain_types(result):
    def is_plain(value):
        if isinstance(value, dict):
            return all(is_plain(v) for v in value.values())
        return type(value) in (bool, int, float, str)

    assert {k: v for k, v in result.summary.items() if not is_plain(v)} == {}


def test_chi2_equals_that_of_the_residuals(result):
    rows = result.residuals
    chi2 = ((rows["residual_x"] / rows["sx"]) ** 2 + (rows["residual_y"] / rows["sy"]) ** 2).sum()
    assert result.summary["chi2"] == pytest.approx(chi2)
    assert result.summary["chi2_per_dof"] == pytest.approx(chi2 / result.summary["dof"])


def test_degrees_of_freedom_count_effective_parameters(result):
    summary = result.summary
    expected = 2 * summary["n_measurements"] - summary["effective_parameters"]
    assert summary["dof"] == pytest.approx(expected)
    assert summary["dof"] == pytest.approx((2.0 - result.residuals["leverage"]).sum(), rel=1e-6)
    assert summary["effective_parameters"] < summary["n_parameters"]


def test_residual_rms_is_in_pixels(result):
    expected = np.sqrt((result.residuals["residual_x"] ** 2).mean())
    assert result.summary["residual_rms_x"] == pytest.approx(expected)


def test_iterations_equal_the_steps_of_the_trace(result):
    assert result.summary["iterations"] == result.trace["iteration"].max()


@pytest.mark.parametrize("axis", ["ra", "dec"])
def test_normalised_deviation_uses_the_reference_sources(result, axis):
    """Reproduce Eq. (result:deviation)."""
    reference = result.sources[result.sources["is_reference"]]
    ratio = reference[f"offset_{axis}"] / reference[f"prior_sigma_{axis}"]
    expected = np.sqrt((ratio**2).mean())
    assert result.summary[f"normalised_deviation_{axis}"] == pytest.approx(expected)


@pytest.mark.parametrize("axis", ["ra", "dec"])
def test_expected_normalised_deviation_accounts_for_shrinkage(result, axis):
    reference = result.sources[result.sources["is_reference"]]
    ratio = reference[f"sigma_{axis}_marginal"] / reference[f"prior_sigma_{axis}"]
    expected = np.sqrt((1.0 - ratio**2).mean())
    assert result.summary[f"expected_normalised_deviation_{axis}"] == pytest.approx(expected)


def tables(ra, ra_true, n_obs=MIN_OBS, dec=60.0):
    n = len(ra)
    sources = pd.DataFrame(
        {
            "source_id": np.arange(n),
            "is_reference": False,
            "is_artificial": np.arange(n) >= n - 1,
            "n_obs": n_obs,
            "ra": ra,
            "dec": dec,
            "sigma_ra_marginal": 2.0,
            "sigma_dec_marginal": 1.0,
        }
    )
    places = pd.DataFrame({"source_id": np.arange(n), "ra": ra_true, "dec": dec})
    return sources, places.assign(induced_ra=0.1, induced_dec=-0.2)


def test_deviation_is_on_the_sky_and_pulls_use_marginal_sigmas():
    mas = 1.0 / 3.6e6
    figures = truth_summary(*tables([10.0 + 8 * mas, 10.0, 10.0], [10.0, 10.0, 10.0]))
    found = figures["non-reference"]
    assert found["n"] == 2
    assert found["mean_ra"] == pytest.approx(2.0, abs=1e-6)
    assert found["rms_ra"] == pytest.approx(np.sqrt(8.0), abs=1e-6)
    assert found["pull_sd_ra"] == pytest.approx(1.0, abs=1e-6)
    # An error that all share is part of it.
    assert found["pull_rms_ra"] == pytest.approx(np.sqrt(2.0), abs=1e-6)
    assert found["induced_ra"] == pytest.approx(0.1)
    assert figures["artificial"]["n"] == 1


def test_deviation_across_zero_hours_is_small():
    mas = 1.0 / 3.6e6
    figures = truth_summary(*tables([mas, 360.0 - mas], [360.0 - mas, mas]))
    assert figures["non-reference"]["mean_ra"] == pytest.approx(1.0, abs=1e-4)
    assert figures["artificial"]["mean_ra"] == pytest.approx(-1.0, abs=1e-4)


def test_sources_with_few_measurements_are_omitted():
    figures = truth_summary(*tables([10.0, 10.0], [10.0, 10.0], n_obs=[MIN_OBS - 1, MIN_OBS]))
    assert set(figures) == {"artificial"}


def test_every_source_is_in_one_class(result):
    members = class_members(result.sources)
    total = sum(m.astype(int) for m in members.values())
    assert (total == 1).all()
    assert list(members) == ["reference", "non-reference", "artificial"]
