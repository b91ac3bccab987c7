"""Tables of a fitted survey, against positions by vectors and closed forms."""

import numpy as np
import pandas as pd
import pytest

from plateviz import tables
from solver.data import survey_schema
from solver.model.apparent_motion import julian_year, mjd_of, motion_design, parallax_factors
from solver.model.astrometry import frames_at, sky_position
from solver.model.directions import offsets_mas
from solver.model.ephemeris import observer_at
from tests.plateviz.survey_tables import EPOCH, places

KINDS = ["reference", "artificial", "other"]
UAS = 1e-3


@pytest.mark.parametrize(
    ("name", "table"),
    [
        ("orbits", survey_schema.RUN_ORBITS),
        ("motions", survey_schema.MOTIONS),
        ("history", survey_schema.HISTORY),
    ],
)
def test_sample_has_the_columns_of_the_schema(survey, name, table):
    assert list(getattr(survey, name)) == table.names


def test_julian_years_and_mjds_convert_both_ways():
    assert julian_year(51544.5) == 2000.0
    assert mjd_of(julian_year(62000.25)) == pytest.approx(62000.25, abs=1e-6)


def test_parallax_factors_are_those_of_the_solver(survey):
    row = survey.catalogue.iloc[[0]].assign(pmra=0.0, pmdec=0.0, parallax=100.0)
    position = observer_at(np.array([62000.0])).position[0]
    ra, dec = sky_position(frames_at(row, 62000.0, position)[:, 0])
    moved = offsets_mas(ra, dec, row["ra"], row["dec"])
    factors = parallax_factors(row["ra"].iloc[0], row["dec"].iloc[0], position)
    assert np.ravel(moved) == pytest.approx(100.0 * np.array(factors), abs=UAS)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("series", ["catalogue", "true"])
def test_curves_pass_through_the_positions_at_the_orbits(survey, kind, series):
    source = survey.source(kind)
    track, curve = tables.source_track(*source), tables.source_curves(*source)
    for axis in ("ra", "dec"):
        between = np.interp(track["year"], curve["year"], curve[f"{series}_{axis}_mas"])
        assert between == pytest.approx(track[f"{series}_{axis}_mas"].to_numpy(), abs=UAS)


@pytest.mark.parametrize("kind", KINDS)
def test_origin_of_the_track_is_the_catalogue_at_the_epoch_of_the_motion(survey, kind):
    history, motion = survey.source(kind)
    track = tables.source_track(history, motion)
    row = survey.catalogue[survey.catalogue["source_id"] == history["source_id"].iloc[0]]
    ra, dec = places(row, mjd_of(np.array([motion["epoch"]])))[0, 0]
    expected = offsets_mas(history["ra"], history["dec"], ra, dec)
    assert track["ra_mas"].to_numpy() == pytest.approx(np.asarray(expected[0]), abs=0.03)
    assert track["dec_mas"].to_numpy() == pytest.approx(np.asarray(expected[1]), abs=0.03)


def test_fitted_motion_follows_the_row_of_motions(survey):
    history, motion = survey.source("other")
    track = tables.source_track(history, motion)
    fit = motion[[f"fit_{n}" for n in survey_schema.MOTION_PARAMETERS]].to_numpy(dtype=float)
    ra, dec = float(history["ra"].mean()), float(history["dec"].mean())
    offset = motion_design(ra, dec, history["epoch"].to_numpy(), EPOCH) @ fit
    drawn = track["fit_ra_mas"] - track["catalogue_ra_mas"]
    assert drawn.to_numpy() == pytest.approx(offset[:, 0], abs=UAS)


@pytest.mark.parametrize("kind", KINDS)
def test_band_of_the_fit_is_its_sigma_at_its_epoch(survey, kind):
    history, motion = survey.source(kind)
    # For a source measured throughout, position and motion are nearly uncorrelated at the epoch.
    curve = tables.source_curves(history, motion)
    band = np.interp(EPOCH, curve["year"], curve["fit_sigma_ra_mas"])
    assert band == pytest.approx(motion["sigma_ra"], rel=0.03)


def test_band_of_the_fit_includes_correlations(survey):
    """Far from the fit's epoch the errors of position and motion cancel between the orbits."""
    history, motion = survey.source("other")
    late = history[history["epoch"] > history["epoch"].median()]
    curve = tables.source_curves(late, motion)
    assert curve["fit_sigma_ra_mas"].min() < 2.0 * 0.66 / np.sqrt(len(late))


def test_one_orbit_has_a_track_but_no_curve(survey):
    source = survey.source("other", -1)
    assert len(tables.source_track(*source)) == 1
    assert tables.source_curves(*source).empty


def test_origin_of_a_reference_sources_sky_track_is_the_catalogue(survey):
    table = tables.sky_track(*survey.source("reference"))
    assert set(table["zero"]) == {"catalogue"}
    assert table["catalogue_ra_mas"].notna().all()


def test_origin_of_a_sky_track_is_at_the_epoch_of_the_fitted_motion(survey):
    history, motion = survey.source("reference")
    whole = tables.sky_track(history, motion)
    first, last = whole["year"].min(), whole["year"].max()
    within = motion.copy()
    within["epoch"] = 0.3 * first + 0.7 * last
    origin = tables.sky_track(history, within)
    assert set(origin["origin_year"]) == {within["epoch"]}
    # The same place on the sky, from another origin.
    shift = whole["ra_mas"] - origin["ra_mas"]
    assert np.ptp(shift[whole["kind"] == "orbit"]) < UAS
    beyond = motion.copy()
    beyond["epoch"] = last + 1.0
    mean = whole.loc[whole["kind"] == "orbit", "year"].mean()
    found = tables.sky_track(history, beyond)["origin_year"].iloc[0]
    assert found == pytest.approx(mean, abs=1e-6)


@pytest.mark.parametrize("kind", ["artificial", "other"])
def test_sky_track_leaves_out_a_far_catalogue(survey, kind):
    table = tables.sky_track(*survey.source(kind))
    assert set(table["zero"]) == {"true"}
    assert table["catalogue_ra_mas"].isna().all()
    assert table["rms_catalogue_mas"].iloc[0] > 100.0


def test_artificial_source_has_its_truth_at_zero(survey):
    table = tables.sky_track(*survey.source("artificial"))
    assert np.abs(table[["true_ra_mas", "true_dec_mas"]].to_numpy()).max() < UAS


@pytest.mark.parametrize(("has_motion", "zero"), [(True, "fit"), (False, "mean")])
def test_sky_track_without_truth_has_another_origin(survey, has_motion, zero):
    history, motion = survey.source("other")
    blind = history.assign(true_offset_ra=np.nan, true_offset_dec=np.nan)
    table = tables.sky_track(blind, motion if has_motion else None)
    assert set(table["zero"]) == {zero}
    assert np.abs(table["ra_mas"]).min() < 5.0


@pytest.mark.parametrize("kind", KINDS)
def test_track_statistics_agree_with_the_motions(survey, kind):
    history, motion = survey.source(kind)
    statistics = tables.track_statistics(tables.sky_track(history, motion))
    assert statistics.n == motion["n_orbits"]
    assert statistics.rms_ra == pytest.approx(motion["rms_truth_ra"], rel=1e-6)
    assert statistics.rms_2d == pytest.approx(motion["rms_truth_2d"], rel=1e-6)


def test_origin_of_the_time_series_is_the_truth(survey):
    history, motion = survey.source("reference")
    table = tables.time_series(history, motion)
    orbits = table[(table["coordinate"] == "dec") & (table["kind"] == "orbit")]
    expected = history["offset_dec"] - history["true_offset_dec"]
    assert orbits["offset_mas"].to_numpy() == pytest.approx(expected.to_numpy(), abs=1e-6)
    assert (table["true_mas"] == 0.0).all()
    assert table["catalogue_mas"].notna().all()


def test_time_series_leaves_out_a_far_catalogue(survey):
    assert tables.time_series(*survey.source("other"))["catalogue_mas"].isna().all()


def test_time_series_residuals_are_over_the_noise(survey):
    history, motion = survey.source("other")
    table = tables.time_series(history, motion)
    chi2 = float((table["pull"] ** 2).sum())
    assert chi2 == pytest.approx(motion["chi2"], rel=1e-4)


@pytest.mark.parametrize(("has_motion", "zero"), [(True, "fit"), (False, "mean")])
def test_time_series_without_truth_has_another_origin(survey, has_motion, zero):
    history, motion = survey.source("other")
    blind = history.assign(true_offset_ra=np.nan, true_offset_dec=np.nan)
    table = tables.time_series(blind, motion if has_motion else None)
    orbits = table[table["kind"] == "orbit"]
    assert set(table["zero"]) == {zero}
    assert abs(orbits["offset_mas"].mean()) < 0.5


def test_tracks_do_not_depend_on_the_order_of_rows(survey):
    history, motion = survey.source("other")
    pd.testing.assert_frame_equal(
        tables.sky_track(history, motion), tables.sky_track(history.iloc[::-1], motion)
    )


def test_sky_distribution_is_in_galactic_coordinates(survey):
    table = tables.sky_distribution(survey.catalogue, survey.truth)
    artificial = table[table["source_class"] == tables.ARTIFICIAL]
    assert len(table) == len(survey.catalogue)
    assert (artificial["l_deg"] + 0.3).abs().max() < 0.3
    assert (artificial["b_deg"] - 0.1).abs().max() < 0.2


def test_sky_distribution_does_not_jump_at_half_a_turn(survey):
    table = survey.catalogue.assign(ra=np.linspace(86.0, 87.0, len(survey.catalogue)), dec=28.9)
    assert np.ptp(tables.sky_distribution(table)["l_deg"]) < 2.0


def test_sky_density_counts_every_source(survey):
    table = tables.sky_distribution(survey.catalogue)
    cells = tables.sky_density(table)
    assert cells["n"].sum() == len(table)
    assert cells["density"].notna().equals(cells["n"] > 0)


def test_sky_density_of_a_uniform_field_is_number_over_area():
    l_deg, b_deg = (g.ravel() for g in np.meshgrid(np.linspace(0, 2, 200), np.linspace(0, 1, 100)))
    table = pd.DataFrame({"l_deg": l_deg, "b_deg": b_deg})
    assert tables.sky_density(table)["density"].mean() == pytest.approx(20_000 / 7200.0, rel=0.01)


def test_prior_separation_agrees_with_positions_at_the_epoch(survey):
    table = tables.prior_separation(survey.catalogue, survey.truth)
    mjd = float(mjd_of(2029.0))
    position = observer_at(np.array([mjd])).position[0]
    (ra, dec), (ra_true, dec_true) = (
        sky_position(frames_at(t, mjd, position)[:, 0]) for t in (survey.catalogue, survey.truth)
    )
    expected = np.hypot(*offsets_mas(ra, dec, ra_true, dec_true))
    assert table["separation_mas"].to_numpy() == pytest.approx(expected, rel=1e-5, abs=UAS)


def test_prior_separation_counts_artificial_sources_as_non_reference(survey):
    table = tables.prior_separation(survey.catalogue, survey.truth)
    assert (table.loc[table["is_artificial"], "group"] == "non-reference").all()


def test_prior_separation_states_the_sigma_of_the_epoch(survey):
    table = tables.prior_separation(survey.catalogue, survey.truth, epoch=2016.0)
    reference = table[table["group"] == "reference"]
    place = np.sqrt(0.5 * (0.02**2 + 0.018**2))
    assert reference["sigma_mas"].to_numpy() == pytest.approx(place, rel=0.5)
    later = tables.prior_separation(survey.catalogue, survey.truth)["sigma_mas"]
    assert later.iloc[0] == pytest.approx(np.sqrt(0.5 * (0.274**2 + 0.235**2)), rel=0.01)


def test_prior_separation_uses_the_correlations(survey):
    catalogue = survey.catalogue.assign(ra_pmra_corr=1.0)
    plain = tables.prior_separation(survey.catalogue, survey.truth)["sigma_mas"].iloc[0]
    linked = tables.prior_separation(catalogue, survey.truth)["sigma_mas"].iloc[0]
    assert 2.0 * (linked**2 - plain**2) == pytest.approx(2 * 0.02 * 13 * 0.021, rel=1e-6)


def test_prior_separation_histogram_counts_every_source(survey):
    table = tables.prior_separation(survey.catalogue, survey.truth)
    bins = tables.prior_separation_histogram(table)
    for group, rows in bins.groupby("group"):
        assert rows["count"].sum() + rows["outside"].iloc[0] == (table["group"] == group).sum()


def test_prior_separation_without_truth_has_no_rows(survey):
    assert tables.prior_separation(survey.catalogue, None).empty


def test_orbit_counts_include_every_source(survey):
    bins = tables.orbit_counts(survey.motions)
    sums = bins.groupby("source_class")["count"].sum()
    assert sums.to_dict() == {"artificial": 12, "non-reference": 36, "reference": 24}
    assert bins["right"].max() > survey.motions["n_orbits"].max()


@pytest.mark.parametrize(("most", "step"), [(1, 1), (50, 1), (51, 2), (100, 2), (101, 3)])
def test_orbit_counts_have_at_most_fifty_bins(survey, most, step):
    motions = survey.motions.assign(n_orbits=1)
    motions.loc[0, "n_orbits"] = most
    bins = tables.orbit_counts(motions)
    assert (bins["right"] - bins["left"] == step).all()
    assert bins["count"].sum() == len(motions)


def test_reference_scatter_keeps_reference_sources_with_enough_orbits(survey):
    table = tables.reference_scatter(survey.motions, least_orbits=80)
    chosen = survey.motions[survey.motions["is_reference"] & (survey.motions["n_orbits"] >= 80)]
    assert set(table["id"]) == set(chosen["source_id"].astype(str))
    ra = table[table["coordinate"] == "ra"]
    assert ra["pull"].to_numpy() == pytest.approx(
        (chosen["mean_deviation_ra"] / chosen["expected_deviation_ra"]).to_numpy()
    )


def test_scatter_cells_count_every_source(survey):
    table = tables.reference_scatter(survey.motions)
    assert tables.scatter_cells(table)["n"].sum() == len(table)


def test_pull_bins_count_values_inside_and_beyond_the_limit():
    bins = tables.pull_bins(pd.Series([0.0, 1.0, -7.0, np.nan]))
    assert bins["count"].sum() == 2
    assert bins["outside"].iloc[0] == 1
    assert bins["n"].iloc[0] == 3


def test_motion_pulls_are_of_non_reference_sources_with_enough_orbits(survey):
    bins = tables.motion_pulls(survey.motions)
    chosen = survey.motions[~survey.motions["is_reference"] & (survey.motions["n_orbits"] >= 40)]
    assert list(bins["parameter"].unique()) == [*survey_schema.MOTION_PARAMETERS, "chi2"]
    assert set(bins["n"]) == {len(chosen)}
    parallax = bins[bins["parameter"] == "parallax"]
    assert parallax["sd"].iloc[0] == pytest.approx(chosen["pull_parallax"].std())


def test_motion_pulls_without_truth_keep_chi2(survey):
    blind = survey.motions.assign(
        **{f"pull_{name}": np.nan for name in survey_schema.MOTION_PARAMETERS}
    )
    assert list(tables.motion_pulls(blind)["parameter"].unique()) == ["chi2"]


def test_orbit_health_places_a_failed_orbit_between_its_neighbours(survey):
    table = tables.orbit_health(survey.orbits).set_index("orbit_id")
    assert table["state"].value_counts().to_dict() == {"complete": 87, "failed": 2, "missing": 1}
    assert table["year"].loc[10] < table["year"].loc[11] < table["year"].loc[12]
    assert table["year"].loc[12] < table["year"].loc[13]


def test_orbit_health_marks_orbits_that_did_not_converge(survey):
    orbits = survey.orbits.copy()
    orbits.loc[3, "converged"] = 0.0
    assert tables.orbit_health(orbits)["state"].iloc[3] == "not converged"


def test_orbit_health_has_the_expected_scatter(survey):
    table = tables.orbit_health(survey.orbits)
    assert table["expected_sd"].iloc[0] == pytest.approx(
        np.sqrt(2.0 / survey.orbits["dof"].iloc[0])
    )
    assert table["z"].std() == pytest.approx(1.0, abs=0.35)
