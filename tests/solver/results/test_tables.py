import numpy as np
import pandas as pd
import pytest

from solver.data.parameters import BY_NAME, CALIBRATION_GROUPS
from solver.data.schema import CALIBRATION, EXPOSURES, RESIDUALS, SOURCES, TRACE, TRUE_PLACES
from tests.solver.small_orbit import ASTROMETRY, MJD, earth, epoch_places

TABLES = {
    "sources": SOURCES,
    "residuals": RESIDUALS,
    "calibration": CALIBRATION,
    "exposures": EXPOSURES,
    "trace": TRACE,
    "true_places": TRUE_PLACES,
}


@pytest.mark.parametrize("name", TABLES)
def test_table_has_the_columns_and_types_of_the_schema(result, name):
    table, frame = TABLES[name], getattr(result, name)
    assert list(frame.columns) == table.names
    for column in table:
        if column.dtype == "str":
            assert all(isinstance(value, str) for value in frame[column.name])
        else:
            assert frame[column.name].dtype == np.dtype(column.dtype)


@pytest.mark.parametrize("name", TABLES)
def test_only_columns_that_may_be_nan_contain_nan(result, name):
    table, frame = TABLES[name], getattr(result, name)
    with_nan = [c for c in frame if frame[c].isna().any()]
    assert all(table[c].may_be_nan for c in with_nan)


def test_sources_are_in_ascending_order(result):
    assert result.sources["source_id"].is_monotonic_increasing


def test_sources_count_their_measurements(small_orbit, result):
    counts = small_orbit.data.measurements["source_id"].value_counts()
    found = result.sources.set_index("source_id")["n_obs"]
    pd.testing.assert_series_equal(found, counts.sort_index(), check_names=False)


def separation_mas(sources, column, prior):
    """Return estimate minus prior along right ascension or declination."""
    difference = sources[column] - sources[f"prior_{column}"]
    if column == "ra":
        difference = ((difference + 180.0) % 360.0 - 180.0) * np.cos(np.radians(prior))
    return 3.6e6 * difference


@pytest.mark.parametrize("column", ["ra", "dec"])
def test_offset_of_a_source_is_estimate_minus_prior(result, column):
    sources = result.sources
    expected = separation_mas(sources, column, sources["prior_dec"])
    # The tangent plane deviates by the square of 1 arcsec, about 5 uas.
    np.testing.assert_allclose(sources[f"offset_{column}"], expected, atol=0.02)


def test_prior_of_a_source_is_its_catalogue_position_at_the_mean_epoch(small_orbit, result):
    rows = small_orbit.data.catalogue.set_index("source_id").loc[result.sources["source_id"]]
    epoch = small_orbit.data.exposures["obstime"].mean()
    ra, dec = epoch_places(rows, epoch)
    np.testing.assert_allclose(result.sources["prior_ra"], ra, atol=3e-13)
    np.testing.assert_allclose(result.sources["prior_dec"], dec, atol=3e-13)


def test_prior_sigma_of_a_source_includes_proper_motion_and_parallax(small_orbit, result):
    rows = small_orbit.data.catalogue.set_index("source_id").loc[result.sources["source_id"]]
    years = 2000.0 + (small_orbit.data.exposures["obstime"].mean() - 51544.5) / 365.25 - 2016.0
    ra, dec = np.radians(rows["ra"]), np.radians(rows["dec"])
    north = np.stack([-np.sin(dec) * np.cos(ra), -np.sin(dec) * np.sin(ra), np.cos(dec)], axis=-1)
    by_parallax = (north @ earth(MJD)[0]) * rows["parallax_error"]
    expected = np.sqrt(rows["dec_error"] ** 2 + (years * rows["pmdec_error"]) ** 2 + by_parallax**2)
    np.testing.assert_allclose(result.sources["prior_sigma_dec"], expected, rtol=1e-6)


def test_prior_correlation_is_that_of_the_prior_covariance(solution, result):
    covariance = np.linalg.inv(solution.problem.priors.precision)
    both = result.sources["prior_corr"] * result.sources["prior_sigma_ra"]
    found = both * result.sources["prior_sigma_dec"]
    np.testing.assert_allclose(found, covariance[:, 0, 1], rtol=1e-9, atol=1e-15)
    # The catalogue has no correlation of the coordinates; the parallax gives a small one.
    assert result.sources["prior_corr"].abs().max() > 1e-5


def test_marginal_sigmas_lie_between_the_conditional_and_the_prior_ones(result):
    sources = result.sources
    for axis in ("ra", "dec"):
        assert (sources[f"sigma_{axis}_conditional"] < sources[f"sigma_{axis}_marginal"]).all()
        assert (sources[f"sigma_{axis}_marginal"] < sources[f"prior_sigma_{axis}"]).all()


def test_correlations_equal_those_of_the_covariances(solution, result):
    covariance = solution.covariance.source
    expected = covariance[:, 0, 1] / np.sqrt(covariance[:, 0, 0] * covariance[:, 1, 1])
    np.testing.assert_allclose(result.sources["corr_marginal"], expected, atol=1e-6)
    assert result.sources["corr_conditional"].abs().max() < 1.0


@pytest.mark.parametrize("table", ["sources", "exposures"])
def test_chi2_and_dof_sum_to_those_of_the_fit(result, table):
    frame = getattr(result, table)
    assert frame["chi2"].sum() == pytest.approx(result.summary["chi2"])
    assert frame["dof"].sum() == pytest.approx(result.summary["dof"])
    assert frame["n_obs"].sum() == result.summary["n_measurements"]


def test_residuals_keep_the_rows_of_the_measurements(small_orbit, result):
    measurements = small_orbit.data.measurements
    columns = list(measurements.columns)
    pd.testing.assert_frame_equal(result.residuals[columns], measurements)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_residual_is_measured_minus_model(result, axis):
    rows = result.residuals
    expected = rows[f"n{axis}"] - rows[f"model_{axis}"]
    np.testing.assert_allclose(rows[f"residual_{axis}"], expected, atol=1e-9)


def test_standardised_residual_is_larger_than_the_whitened_one(result):
    rows = result.residuals
    whitened = (rows["residual_x"] / rows["sx"]) ** 2 + (rows["residual_y"] / rows["sy"]) ** 2
    standardised = rows["standardised_x"] ** 2 + rows["standardised_y"] ** 2
    assert (standardised >= whitened).all()


def test_distortion_displaces_the_focal_plane(result):
    rows = result.residuals
    displaced = np.hypot(rows["focal_x"] - rows["ideal_x"], rows["focal_y"] - rows["ideal_y"])
    assert 0.5 < displaced.max() < 20.0


def test_calibration_has_every_group_in_the_order_of_the_parameter_table(result, solution):
    found = result.calibration.groupby("group", sort=False).size()
    layout = solution.problem.layout
    assert found.to_dict() == {g.name: len(layout.columns(g)) for g in CALIBRATION_GROUPS}
    assert list(found.index) == [g.name for g in CALIBRATION_GROUPS]


def test_calibration_labels_name_exposure_term_and_detector(result):
    labels = result.calibration.set_index(["group", "element"])["label"]
    assert labels["pointing_ra", 5] == "field 1 plate 1"
    assert labels["distortion_x", 0] == "A(2,0)"
    assert labels["distortion_y", 17] == "B(0,5)"
    assert labels["pitch_y", 3] == "detector 3"


def truth_of(orbit, group):
    values = getattr(orbit.truth, group)
    if not isinstance(values, dict):
        return values
    return np.array([values[n - j, j] for n in range(2, 6) for j in range(n + 1)])


@pytest.mark.parametrize("group", [g.name for g in CALIBRATION_GROUPS])
def test_calibration_is_within_its_uncertainty_of_the_truth(small_orbit, result, group):
    rows = result.calibration[result.calibration["group"] == group]
    to_unit = {"deg": 3600.0, "um": 1.0}[rows["value_unit"].iloc[0]]
    error = (rows["value"].to_numpy() - truth_of(small_orbit, group)) * to_unit
    if group == "pointing_ra":
        error *= np.cos(np.radians(small_orbit.truth.pointing_dec))
    assert np.abs(error / rows["sigma_marginal"]).max() < 4.5


def test_value_is_centre_plus_offset(result):
    rows = result.calibration
    simple = rows[~rows["group"].isin(["pointing_ra", "pointing_dec"])]
    to_unit = np.where(simple["value_unit"] == simple["unit"], 1.0, 3600.0)
    expected = (simple["value"] - simple["prior_centre"]) * to_unit
    np.testing.assert_allclose(simple["offset"], expected, atol=1e-6)


def test_prior_share_is_between_zero_and_one(result):
    rows = result.calibration.set_index("group")
    assert rows["prior_share"].between(0.0, 1.0).all()
    assert (rows.loc["position_angle", "prior_share"] == 0.0).all()
    assert np.isinf(rows.loc["position_angle", "prior_sigma"]).all()


def test_conditional_sigmas_of_the_calibration_are_below_the_marginal_ones(result):
    rows = result.calibration
    assert (rows["sigma_conditional"] < rows["sigma_marginal"]).all()


def test_true_places_are_the_truth_at_the_mean_epoch(small_orbit, result):
    truth = small_orbit.data.truth.set_index("source_id").loc[result.true_places["source_id"]]
    ra, dec = epoch_places(truth, small_orbit.data.exposures["obstime"].mean())
    # 3e-13 deg is 0.001 uas.
    np.testing.assert_allclose(result.true_places["ra"], ra, atol=3e-13)
    np.testing.assert_allclose(result.true_places["dec"], dec, atol=3e-13)


def test_true_places_include_measured_sources_with_a_truth(small_orbit, fit, with_tables):
    truth = small_orbit.data.truth.iloc[::2]
    places = fit(with_tables(small_orbit, truth=truth)).true_places
    measured = set(small_orbit.data.measurements["source_id"])
    assert set(places["source_id"]) == measured & set(truth["source_id"])


def test_without_truth_there_are_no_true_places(small_orbit, fit, with_tables):
    result = fit(with_tables(small_orbit, truth=None))
    assert result.true_places is None
    assert "truth" not in result.summary


def test_error_free_reference_catalogue_removes_the_induced_shift(
    small_orbit, result, fit, with_tables
):
    catalogue, truth = small_orbit.data.catalogue.copy(), small_orbit.data.truth
    is_reference = catalogue["is_reference"].to_numpy()
    catalogue.loc[is_reference, ASTROMETRY] = truth.loc[is_reference, ASTROMETRY]
    perfect = fit(with_tables(small_orbit, catalogue=catalogue))
    found = 3.6e6 * (result.sources["dec"] - perfect.sources["dec"])
    induced = result.true_places["induced_dec"]
    assert induced.abs().max() > 1.0
    np.testing.assert_allclose(found, induced, atol=1e-3)


def test_values_on_an_axis_have_one_column_per_group(result):
    wide = result.values_on("det", "sigma_marginal")
    assert wide.shape == (4, 5)
    rows = result.calibration.set_index(["group", "element"])["sigma_marginal"]
    assert wide.loc[2, "pitch_x"] == rows["pitch_x", 2]


@pytest.mark.parametrize("group", ["pitch_x", "distortion_y", "position_angle"])
def test_values_of_a_group_are_its_column_on_its_axis(result, group):
    wide = result.values_on(BY_NAME[group].axis, "sigma_marginal")
    np.testing.assert_array_equal(result.values_of(group, "sigma_marginal"), wide[group])


def test_values_of_a_group_that_is_not_fitted_are_an_error(result):
    with pytest.raises(KeyError, match="detector_skew"):
        result.values_of("detector_skew")
