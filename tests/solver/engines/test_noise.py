"""The noise model of the measurements and the reference stars, on small orbits."""

from dataclasses import replace

import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.fit import OrbitFitter, fit_orbit
from solver.simulate.settings import SurveySettings
from solver.units import MAS_PER_DEG
from tests.campaigns.defects import defective_orbit


def understated(data, factor):
    """Return the tables with stated uncertainties too small by a factor of each measurement."""
    rows = data.measurements
    return replace(data, measurements=rows.assign(sx=rows["sx"] / factor, sy=rows["sy"] / factor))


def factor_of(result, name):
    """Return an estimated factor, and the uncertainty of its logarithm."""
    noise = result.summary["noise"]
    assert noise["converged"]
    return np.exp(noise["log_factor"][name]), noise["sigma"][name]


def test_scale_of_the_noise_is_recovered_and_applied(small_orbit):
    data = understated(small_orbit.data, 3.0)
    fitter = OrbitFitter(data, small_orbit.instrument)
    result = fitter.fit(FitSettings(noise_scale=True))
    factor, sigma = factor_of(result, "all")
    assert np.log(factor / 3.0) == pytest.approx(0.0, abs=4.0 * sigma)
    assert result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=1e-3)
    # The result states the estimated uncertainties; those of the given tables are as they were.
    stated = data.measurements["sx"].to_numpy()
    np.testing.assert_allclose(result.residuals["sx"].to_numpy(), factor * stated)
    assert fit_orbit(data, small_orbit.instrument).summary["chi2_per_dof"] > 7.0
    # A what-if keeps the noise model of its fit.
    what_if = fitter.what_if(FitSettings(noise_scale=True, prior_widths={"pitch_x": 0.005}))
    assert what_if.summary["noise"] == result.summary["noise"]
    assert what_if.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.01)


def test_noise_of_each_exposure_is_recovered(small_orbit):
    data = small_orbit.data
    true = 1.0 + 2.0 * (data.measurements["plate_id"] == 1).to_numpy()
    result = fit_orbit(
        understated(data, true), small_orbit.instrument, FitSettings(noise_by_exposure=True)
    )
    for exposure in data.exposures.itertuples():
        name = f"exposure {exposure.field_id}/{exposure.plate_id}"
        factor, sigma = factor_of(result, name)
        expected = 3.0 if exposure.plate_id == 1 else 1.0
        assert np.log(factor / expected) == pytest.approx(0.0, abs=4.0 * sigma)


def test_noise_that_differs_by_orders_of_magnitude_is_recovered(small_orbit):
    data = small_orbit.data
    plates = data.measurements["plate_id"].to_numpy()
    true = np.where(plates == 0, 20.0, np.where(plates == 1, 0.1, 1.0))
    result = fit_orbit(
        understated(data, true), small_orbit.instrument, FitSettings(noise_by_exposure=True)
    )
    for exposure in data.exposures.itertuples():
        name = f"exposure {exposure.field_id}/{exposure.plate_id}"
        factor, sigma = factor_of(result, name)
        expected = {0: 20.0, 1: 0.1}.get(exposure.plate_id, 1.0)
        assert np.log(factor / expected) == pytest.approx(0.0, abs=4.0 * sigma)


def test_noise_by_magnitude_is_recovered(small_orbit):
    data = small_orbit.data
    magnitude = np.random.default_rng(0).uniform(10.0, 19.0, len(data.catalogue))
    catalogue = data.catalogue.assign(magnitude=magnitude)
    of_row = catalogue.set_index("source_id")["magnitude"][data.measurements["source_id"]]
    from_mean = of_row.to_numpy() - of_row.mean()
    true = np.exp(0.2 * from_mean - 0.02 * from_mean**2)
    given = replace(understated(data, true), catalogue=catalogue)
    result = fit_orbit(given, small_orbit.instrument, FitSettings(noise_by_magnitude=True))
    expected = {"per magnitude": 0.2, "per magnitude^2": -0.02, "per magnitude^3": 0.0}
    for name, value in expected.items():
        factor, sigma = factor_of(result, name)
        assert np.log(factor) == pytest.approx(value, abs=4.0 * sigma)
        assert sigma < 0.05


def displaced_references(orbit, factor, seed):
    """Return the tables with catalogue errors larger than stated by a factor."""
    sources = fit_orbit(orbit.data, orbit.instrument).sources.set_index("source_id")
    catalogue = orbit.data.catalogue.copy()
    rows = np.flatnonzero(catalogue["source_id"].isin(sources.index[sources["is_reference"]]))
    stated = sources.loc[catalogue["source_id"].iloc[rows], ["prior_sigma_ra", "prior_sigma_dec"]]
    deviates = np.random.default_rng(seed).standard_normal(stated.shape)
    added = np.sqrt(factor**2 - 1.0) * stated.to_numpy() * deviates / MAS_PER_DEG
    added[:, 0] /= np.cos(np.radians(catalogue["dec"].iloc[rows]))
    catalogue.loc[catalogue.index[rows], ["ra", "dec"]] += added
    return replace(orbit.data, catalogue=catalogue)


def test_scale_of_the_reference_errors_is_recovered_and_applied(small_orbit):
    settings, factor = FitSettings(reference_scale=True), 100.0
    before = fit_orbit(small_orbit.data, small_orbit.instrument).sources
    logarithms, sigmas = [], []
    for seed in range(2):
        data = displaced_references(small_orbit, factor, seed)
        result = fit_orbit(data, small_orbit.instrument, settings)
        found, sigma = factor_of(result, "references")
        is_reference = result.sources["is_reference"].to_numpy()
        ratio = result.sources["prior_sigma_ra"] / before["prior_sigma_ra"]
        np.testing.assert_allclose(ratio[is_reference], found, rtol=1e-3)
        np.testing.assert_allclose(ratio[~is_reference], 1.0, rtol=1e-3)
        logarithms.append(np.log(found / factor))
        sigmas.append(sigma)
    # A prior must not pull them towards the stated errors.
    assert np.mean(logarithms) == pytest.approx(0.0, abs=2.0 * max(sigmas))
    assert max(sigmas) < 0.2


def test_reference_errors_that_the_data_do_not_show_stay_as_stated(small_orbit):
    result = fit_orbit(small_orbit.data, small_orbit.instrument, FitSettings(reference_scale=True))
    factor, sigma = factor_of(result, "references")
    assert np.log(factor) == pytest.approx(0.0, abs=0.2)
    assert sigma > 0.4


def test_noise_by_magnitude_needs_magnitudes(small_orbit):
    with pytest.raises(InputError, match="expected a column magnitude in the catalogue"):
        fit_orbit(small_orbit.data, small_orbit.instrument, FitSettings(noise_by_magnitude=True))


def test_noise_of_two_magnitudes_is_linear_in_them(small_orbit):
    catalogue = small_orbit.data.catalogue
    of_two = np.where(np.arange(len(catalogue)) % 2, 12.0, 16.0)
    data = replace(small_orbit.data, catalogue=catalogue.assign(magnitude=of_two))
    result = fit_orbit(data, small_orbit.instrument, FitSettings(noise_by_magnitude=True))
    assert set(result.summary["noise"]["log_factor"]) == {"all", "per magnitude"}


def test_noise_by_magnitude_needs_magnitudes_that_differ(small_orbit):
    data = replace(small_orbit.data, catalogue=small_orbit.data.catalogue.assign(magnitude=14.0))
    with pytest.raises(InputError, match="expected stars of different magnitudes"):
        fit_orbit(data, small_orbit.instrument, FitSettings(noise_by_magnitude=True))


def floored(data, floor, stated):
    """Return the tables with smaller stated uncertainties, and noise of these and a floor."""
    rows, rng = data.measurements, np.random.default_rng(0)
    before = rows["sx"].to_numpy()
    assert (np.hypot(stated, floor) >= before).all()
    missing = np.sqrt(stated**2 + floor**2 - before**2)
    noise = missing * rng.standard_normal((2, len(rows)))
    return replace(
        data,
        measurements=rows.assign(
            sx=stated, sy=stated, nx=rows["nx"] + noise[0], ny=rows["ny"] + noise[1]
        ),
    )


@pytest.mark.parametrize("scale", [False, True], ids=["alone", "with-scale"])
def test_floor_of_the_noise_is_recovered(small_orbit, scale):
    data, floor = small_orbit.data, 0.02
    stated = np.random.default_rng(1).uniform(0.005, 0.05, len(data.measurements))
    data = floored(data, floor, stated)
    settings = FitSettings(noise_floor=True, noise_scale=scale)
    result = fit_orbit(data, small_orbit.instrument, settings)
    noise = result.summary["noise"]
    assert noise["converged"]
    assert noise["floor_pix"] == pytest.approx(floor, abs=4.0 * noise["floor_sigma_pix"])
    assert noise["floor_sigma_pix"] < 0.1 * floor
    assert result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.15)
    if scale:
        factor, sigma = factor_of(result, "all")
        assert np.log(factor) == pytest.approx(0.0, abs=4.0 * sigma)
    else:
        expected = np.hypot(stated, noise["floor_pix"])
        np.testing.assert_allclose(result.residuals["sx"], expected)


def test_no_floor_is_found_where_there_is_none(small_orbit):
    noise = fit_orbit(
        small_orbit.data, small_orbit.instrument, FitSettings(noise_floor=True)
    ).summary["noise"]
    assert noise["converged"]
    assert noise["floor_pix"] < 3.0 * noise["floor_sigma_pix"]
    assert 0.0 < noise["floor_sigma_pix"] < 0.5 * small_orbit.data.measurements["sx"].iloc[0]


def test_a_floor_and_a_factor_of_equal_uncertainties_are_refused(small_orbit):
    data, settings = small_orbit.data, FitSettings(noise_floor=True, noise_scale=True)
    equal = replace(data, measurements=data.measurements.assign(sx=0.01, sy=0.01))
    with pytest.raises(InputError, match="a floor does what a factor does"):
        fit_orbit(equal, small_orbit.instrument, settings)


def test_search_does_not_run_away_where_a_power_of_the_magnitude_makes_much_of_a_step():
    settings = SurveySettings(
        orbits=5, seed=2, magnitudes=True, defects=("noise=50%", "detector-shift=0.3um")
    )
    data, _ = defective_orbit(settings.scaled(8000), 0)
    # Stated uncertainties have little to do with the noise.
    wrong = 10.0 ** np.random.default_rng(2).uniform(-0.6, 0.6, len(data.measurements))
    asked = FitSettings(noise_by_magnitude=True, noise_floor=True, reference_scale=True)
    result = fit_orbit(understated(data, wrong), settings=asked)
    assert result.summary["converged"]
    assert result.summary["noise"]["converged"]
    assert result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.02)
