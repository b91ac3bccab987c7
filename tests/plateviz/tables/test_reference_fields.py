"""Scatter of the reference stars between fields: chance, a displaced star, and one field."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2 as chi2_law
from scipy.stats import norm

from plateviz.tables.chance import largest_by_chance
from plateviz.tables.reference_fields import reference_fields, reference_fields_statistics
from solver.fit import fit_orbit
from solver.io.survey import read_survey_orbit
from solver.model.directions import offsets_mas
from tests.plateviz.conftest import synthetic_fit


@pytest.fixture(scope="module")
def table(fit_result, instrument):
    return reference_fields(fit_result, instrument)


def as_references(result):
    """Return a result of which all stars are reference stars."""
    return replace(result, sources=result.sources.assign(is_reference=True))


def sky_of(rows, result):
    """Return where measurements are on the sky, ra and dec in deg, by trigonometry.

    The detectors of the mini-mock have the turns and the pitch of the calibration.
    """
    exposure = result.values_on("exp").iloc[result.exposure_index[rows.index]]
    detector = result.values_on("det").iloc[rows["detector_id"].to_numpy()]
    turn = np.radians(detector["detector_rotation"].to_numpy())
    d_x = rows["residual_x"].to_numpy() * detector["pitch_x"].to_numpy()
    d_y = rows["residual_y"].to_numpy() * detector["pitch_y"].to_numpy()
    x = rows["ideal_x"].to_numpy() + np.cos(turn) * d_x + np.sin(turn) * d_y
    y = rows["ideal_y"].to_numpy() - np.sin(turn) * d_x + np.cos(turn) * d_y
    angle, length = np.radians(exposure["position_angle"]), exposure["focal_length"].to_numpy()
    xi = (-np.cos(angle) * x + np.sin(angle) * y) / length
    eta = (np.sin(angle) * x + np.cos(angle) * y) / length
    ra_0, dec_0 = np.radians(exposure["pointing_ra"]), np.radians(exposure["pointing_dec"])
    below = np.cos(dec_0) - eta * np.sin(dec_0)
    ra = ra_0 + np.arctan2(xi, below)
    dec = np.arctan2(np.sin(dec_0) + eta * np.cos(dec_0), np.hypot(xi, below))
    return np.degrees(ra).to_numpy(), np.degrees(dec).to_numpy()


def test_reference_stars_in_two_fields_have_a_row_per_coordinate(fit_result, table):
    rows = fit_result.residuals.groupby("source_id")["field_id"].agg(["nunique", "size"])
    known = fit_result.sources.query("is_reference")["source_id"]
    wanted = rows[(rows["nunique"] > 1) & rows.index.isin(known)]
    for axis in ("ra", "dec"):
        found = table[table["coordinate"] == axis]
        assert found["id"].tolist() == [str(one) for one in wanted.index]
        assert np.array_equal(found["n_fields"], wanted["nunique"])
        assert np.array_equal(found["n"], wanted["size"])
        assert np.array_equal(found["dof"], wanted["nunique"] - 1)


def test_scatter_is_that_of_the_places_on_the_sky(fit_result, table):
    """Measurements are of one weight here, so that means and scatter are plain ones."""
    residuals = fit_result.residuals
    sigma = residuals[["sx", "sy"]].to_numpy()
    assert np.ptp(sigma) < 1e-12
    for star in table["id"].unique()[:8]:
        rows = residuals[residuals["source_id"] == int(star)]
        origin = fit_result.sources.set_index("source_id").loc[int(star), ["ra", "dec"]]
        predicted = sky_of(rows.assign(residual_x=0.0, residual_y=0.0), fit_result)
        places = np.subtract(
            offsets_mas(*sky_of(rows, fit_result), *origin), offsets_mas(*predicted, *origin)
        )
        for axis, of_axis in zip(("ra", "dec"), places, strict=True):
            by_field = pd.Series(of_axis).groupby(rows["field_id"].to_numpy()).agg(["mean", "size"])
            squares = np.square(by_field["mean"] - of_axis.mean())
            scatter = np.sqrt(np.average(squares, weights=by_field["size"]))
            is_it = (table["id"] == star) & (table["coordinate"] == axis)
            (found,) = table.loc[is_it, "scatter_mas"]
            assert found == pytest.approx(scatter, rel=2e-3)


def test_stars_of_good_solutions_scatter_by_chance(instrument):
    results = [as_references(synthetic_fit(seed)[0]) for seed in range(1, 6)]
    found = [reference_fields_statistics(reference_fields(one, instrument)) for one in results]
    assert sum(one.n for one in found) > 800
    dof = sum(one.dof for one in found)
    assert abs(sum(one.chi2 for one in found) - dof) < 3.0 * np.sqrt(2.0 * dof)
    for one in found:
        assert one.scatter == pytest.approx(np.sqrt(2.0 * one.dof))
        assert one.limit == pytest.approx(largest_by_chance(one.n))
        assert one.largest < one.limit
        assert one.n_beyond == 0


def test_what_the_calibration_of_a_sparse_orbit_absorbs_is_allowed_for(made_survey, instrument):
    """It takes 65 of the 350 degrees of freedom of all stars, or somewhat less."""
    chi2 = dof = squares = 0.0
    for orbit in range(3):
        result = as_references(fit_orbit(read_survey_orbit(made_survey, orbit)))
        table = reference_fields(result, instrument)
        chi2, dof = chi2 + table["chi2"].sum(), dof + table["dof"].sum()
        squares += (share_of(result, table) * table["chi2"]).sum()
    assert squares / dof < 0.92
    assert 0.95 < chi2 / dof < 1.15


def share_of(result, table):
    """Return what the calibration leaves, of a table of all stars."""
    shared = result.calibration.query(
        "group.str.startswith('detector_') or group.str.startswith('pitch_')"
        " or group.str.startswith('distortion_')"
    )
    n_fields = result.exposures["field_id"].nunique()
    absorbed = 4.0 * (n_fields - 1) + (1.0 - shared["prior_share"]).sum()
    return 1.0 - absorbed / table["dof"].sum()


def test_displaced_star_is_found_with_its_chi2(fit_result, instrument, table):
    """All residuals of a star are zero but those in one field, which are the displacement."""
    star = table.loc[table["n_fields"].idxmax(), "id"]
    residuals = fit_result.residuals.copy()
    of_star = residuals["source_id"] == int(star)
    in_field = of_star & (residuals["field_id"] == residuals.loc[of_star, "field_id"].iloc[0])
    sigma = float(residuals["sx"].iloc[0])
    residuals.loc[of_star, ["residual_x", "residual_y"]] = 0.0
    residuals.loc[in_field, "residual_x"] = 5.0 * sigma
    found = reference_fields(replace(fit_result, residuals=residuals), instrument)
    n, of_all = int(in_field.sum()), int(of_star.sum())
    share = share_of(fit_result, reference_fields(as_references(fit_result), instrument))
    chi2 = found.loc[found["id"] == star, "chi2"].sum()
    assert 0 < n < of_all
    assert chi2 == pytest.approx(25.0 * n * (1.0 - n / of_all) / share, rel=1e-4)
    statistics = reference_fields_statistics(found)
    assert statistics.id == star
    assert statistics.n_beyond == 1
    dof = int(found.loc[found["id"] == star, "dof"].sum())
    rare = norm.isf(0.5 * chi2_law.sf(chi2, dof))
    assert statistics.largest == pytest.approx(rare, rel=1e-6)
    others = [one["id"] != star for one in (found, table)]
    pd.testing.assert_frame_equal(found[others[0]], table[others[1]])


def test_expected_scatter_is_that_of_means_of_the_measurements(fit_result, instrument, table):
    pitch = np.mean([one.pitch_x_um for one in instrument.detectors])
    length = fit_result.values_on("exp")["focal_length"].mean()
    sigma = np.degrees(fit_result.residuals["sx"].iloc[0] * pitch / length) * 3.6e6
    share = share_of(fit_result, reference_fields(as_references(fit_result), instrument))
    expected = sigma * np.sqrt(share * table["dof"] / table["n"])
    assert np.allclose(table["expected_mas"], expected, rtol=2e-3)
    ratio = table["scatter_mas"] / table["expected_mas"]
    assert np.allclose(ratio**2, table["chi2"] / table["dof"])


def test_weights_count(fit_result, instrument, table):
    """A field whose measurements have no weight does not move the mean."""
    star = table.loc[table["n_fields"] == 2, "id"].iloc[0]
    residuals = fit_result.residuals.copy()
    of_star = residuals["source_id"] == int(star)
    last = of_star & (residuals["field_id"] == residuals.loc[of_star, "field_id"].max())
    residuals.loc[last, ["sx", "sy"]] *= 1e3
    found = reference_fields(replace(fit_result, residuals=residuals), instrument)
    rows = [one[one["id"] == star] for one in (found, table)]
    assert (rows[0]["scatter_mas"].to_numpy() < 0.01 * rows[1]["scatter_mas"].to_numpy()).all()
    assert (rows[0]["chi2"].to_numpy() < 1e-3).all()


def test_single_field_has_no_rows(fit_result, instrument):
    rows = fit_result.residuals["field_id"] == 0
    exposures = fit_result.exposures["field_id"] == 0
    one = replace(
        fit_result,
        residuals=fit_result.residuals[rows].reset_index(drop=True),
        exposures=fit_result.exposures[exposures].reset_index(drop=True),
    )
    found = reference_fields(one, instrument)
    assert found.empty
    assert list(found) == list(reference_fields(fit_result, instrument))


def test_without_reference_stars_there_are_no_rows(fit_result, instrument):
    none = replace(fit_result, sources=fit_result.sources.assign(is_reference=False))
    assert reference_fields(none, instrument).empty
