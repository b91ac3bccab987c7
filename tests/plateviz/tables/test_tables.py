"""Tables of one orbit, against independent calculations."""

import numpy as np
import pandas as pd
import pytest
from astropy.coordinates import SkyCoord
from astropy.wcs import WCS
from numpy.polynomial import legendre

from plateviz import tables
from plateviz.tables.calibration import displacement_um
from plateviz.tables.labels import element_labels
from solver.data import schema
from solver.model.directions import offsets_mas
from tests.plateviz.tables.fields import without_distortion

BEYOND_DOUBLE = 2**53


def test_fixture_is_complete_against_the_schema(fit_result):
    for table in schema.RESULT_TABLES:
        frame = getattr(fit_result, table.name)
        if table in (schema.LOSSES, schema.OUTLIERS, schema.ORDERS):
            assert frame is None
            continue
        assert list(frame.columns) == table.names
        assert len(frame) > 0


@pytest.mark.parametrize(
    ("ra", "ra_0", "expected_deg"),
    [(1e-4, 359.9999, 2e-4), (359.9999, 1e-4, -2e-4), (266.1, 266.0, 0.1)],
    ids=["across 0 upwards", "across 0 downwards", "plain"],
)
def test_offset_in_ra_wraps_and_includes_cos_dec(ra, ra_0, expected_deg):
    d_ra, d_dec = offsets_mas(np.array([ra]), np.array([60.0]), ra_0, 60.0)
    assert d_ra[0] == pytest.approx(0.5 * expected_deg * 3.6e6, rel=1e-6)
    assert d_dec[0] == 0.0


def test_offsets_agree_with_astropy(fit_result, truth):
    table = tables.deviation(fit_result, truth).merge(
        fit_result.sources[["source_id", "ra", "dec"]], on="source_id"
    )
    true = truth.set_index("source_id").loc[table["source_id"]]
    east, north = SkyCoord(true["ra"], true["dec"], unit="deg").spherical_offsets_to(
        SkyCoord(table["ra"], table["dec"], unit="deg")
    )
    assert np.allclose(table["deviation_ra_mas"], east.to_value("mas"), atol=1e-5)
    assert np.allclose(table["deviation_dec_mas"], north.to_value("mas"), atol=1e-5)


def test_footprint_offsets_are_centred_and_east_positive(fit_result):
    table = tables.footprint_sources(fit_result)
    assert abs(table["x_arcmin"].mean()) < 0.1
    assert abs(table["y_arcmin"].mean()) < 0.1
    assert np.corrcoef(table["x_arcmin"], table["ra"])[0, 1] > 0.99


def test_ids_beyond_2_to_the_53_survive_as_exact_text(fit_result):
    table = tables.footprint_sources(fit_result)
    assert (table["source_id"] > BEYOND_DOUBLE).all()
    assert set(table["id"]) == {str(i) for i in fit_result.sources["source_id"].tolist()}


def test_reference_sources_come_last_so_that_they_are_drawn_on_top(fit_result):
    assert tables.footprint_sources(fit_result)["source_class"].iloc[-1] == tables.REFERENCE
    assert tables.CLASSES[-1] == tables.REFERENCE


def test_footprint_polygons_agree_with_astropy_gnomonic(fit_result, instrument):
    polygons = tables.footprint_fields(fit_result, instrument)
    optics = fit_result.values_on("exp")
    for field_id, field in polygons.groupby("field_id"):
        pointing = optics[(fit_result.exposures["field_id"] == field_id).to_numpy()].iloc[0]
        wcs = _gnomonic(pointing)
        for detector in instrument.detectors:
            rows = field[field["detector_id"] == detector.detector_id].sort_values("corner")
            places = np.column_stack(wcs.all_world2pix(rows["ra"], rows["dec"], 0))
            corners = detector.corners_um()[[0, 1, 2, 3, 0]]
            sides = np.diff(places, axis=0)
            # Aberration moves the whole outline, by at most 21 arcsec or 480 um.
            assert np.allclose(sides, np.diff(corners, axis=0), atol=0.5)
            assert np.abs(places - corners).max() < 480.0


def test_measured_sources_lie_within_the_outlines_of_their_detectors(fit_result, instrument):
    polygons = tables.footprint_fields(fit_result, instrument)
    sources = fit_result.sources.set_index("source_id")
    for (field, plate, detector), corners in polygons.groupby(
        ["field_id", "plate_id", "detector_id"]
    ):
        rows = fit_result.residuals.query(
            f"field_id == {field} and plate_id == {plate} and detector_id == {detector}"
        )
        ring = corners.sort_values("corner")[["ra", "dec"]].to_numpy()
        places = sources.loc[rows["source_id"], ["ra", "dec"]].to_numpy()
        along, towards = np.diff(ring, axis=0), places[:, None, :] - ring[:-1]
        turn = along[:, 0] * towards[:, :, 1] - along[:, 1] * towards[:, :, 0]
        inside = (turn > 0.0).all(axis=1) | (turn < 0.0).all(axis=1)
        # Distortion may move sources within a few pixels of an edge across it.
        assert inside.mean() > 0.95


def _gnomonic(pointing: pd.Series) -> WCS:
    """Return a WCS whose pixels are um on the ideal focal plane, Eq. (method:ideal)."""
    c, s = (f(np.radians(pointing["position_angle"])) for f in (np.cos, np.sin))
    wcs = WCS(naxis=2)
    wcs.wcs.ctype = ["RA---TAN", "DEC--TAN"]
    wcs.wcs.crval = [pointing["pointing_ra"], pointing["pointing_dec"]]
    wcs.wcs.crpix = [1.0, 1.0]
    wcs.wcs.cd = np.degrees(1.0 / pointing["focal_length"]) * np.array([(-c, s), (s, c)])
    return wcs


def test_footprint_outlines_the_first_exposure_of_each_field(fit_result, instrument):
    polygons = tables.footprint_fields(fit_result, instrument)
    assert (polygons["plate_id"] == 0).all()
    assert len(polygons) == 5 * len(instrument.detectors) * 4


def test_residual_vectors_on_a_detector_are_the_residuals(fit_result, instrument):
    table = tables.residual_map(fit_result, instrument, exposures=[(1, 2)], detector_id=3)
    rows = fit_result.residuals.query("field_id == 1 and plate_id == 2 and detector_id == 3")
    assert table["source_id"].tolist() == rows["source_id"].tolist()
    assert np.array_equal(table["u"], rows["residual_x"])
    assert np.array_equal(table["residual_y_mpix"], 1000.0 * rows["residual_y"])
    mas = rows["residual_x"] * 10.0 / 4.86e6 * np.degrees(1.0) * 3.6e6
    assert np.allclose(table["residual_x_mas"], mas, rtol=1e-4)


def test_residual_vectors_on_the_focal_plane_point_along_it(fit_result, instrument):
    table = tables.residual_map(fit_result, instrument)
    rows = fit_result.residuals
    moved = rows[["nx", "ny"]].to_numpy()
    for detector in instrument.detectors:
        on = (rows["detector_id"] == detector.detector_id).to_numpy()
        c, s = (f(np.radians(detector.rotation_deg)) for f in (np.cos, np.sin))
        place = 10.0 * moved[on] @ np.array([(c, -s), (s, c)]) + (detector.x_um, detector.y_um)
        tip = 1000.0 * (table[["x", "y"]].to_numpy() + table[["u", "v"]].to_numpy())[on]
        assert np.allclose(tip, place, atol=1e-6)


@pytest.mark.parametrize("exposures", [[(9, 9)], []], ids=["unknown", "none selected"])
def test_residual_tables_of_no_exposure_are_empty(fit_result, instrument, exposures):
    assert tables.residual_map(fit_result, instrument, exposures=exposures).empty
    assert tables.residual_scatter(fit_result, exposures=exposures).empty


def test_expected_scatter_excludes_what_the_fit_absorbs(fit_result):
    table = tables.residual_scatter(fit_result)
    expected = 10.0 * np.sqrt(1.0 - 0.5 * fit_result.residuals["leverage"])
    assert np.allclose(table["expected_x_mpix"], expected)


def test_binned_vectors_conserve_counts_and_sums(fit_result, instrument):
    table = tables.residual_map(fit_result, instrument)
    means = tables.binned_vectors(table, x_range=(-21, 21), y_range=(-21, 21), bins=7)
    assert means["n"].sum() == len(table)
    assert (means["n"] * means["u"]).sum() == pytest.approx(table["u"].sum())


def test_binned_vectors_leave_out_sparse_bins():
    table = pd.DataFrame({"x": [0.1] * 9 + [0.9], "y": 0.5, "u": 1.0, "v": 0.0})
    means = tables.binned_vectors(table, x_range=(0, 1), y_range=(0, 1), bins=2, least_share=0.25)
    assert means["n"].tolist() == [9]


def test_deviation_has_the_pulls_of_the_marginal_sigma(fit_result, truth):
    table = tables.deviation(fit_result, truth)
    statistics = tables.deviation_statistics(table).set_index("source_class")
    assert set(statistics.index) == set(tables.CLASSES)
    assert statistics["n"].sum() == len(fit_result.sources)
    reference = table[table["source_class"] == tables.REFERENCE]
    pulls = reference["deviation_ra_mas"] / reference["sigma_ra_mas"]
    expected = np.sqrt(np.mean(pulls**2))
    assert statistics.loc[tables.REFERENCE, "pull_rms_ra"] == pytest.approx(expected)
    assert statistics.loc[tables.NON_REFERENCE, "pull_rms_dec"] == pytest.approx(1.0, abs=0.2)


def test_deviation_without_truth_is_empty(fit_result):
    assert tables.deviation(fit_result, None).empty


def test_uncertainty_has_a_row_per_source_kind_and_coordinate(fit_result, instrument):
    table = tables.uncertainty(fit_result, instrument)
    assert len(table) == 4 * len(fit_result.sources)
    assert table["sigma_single_mas"].iloc[0] == pytest.approx(4.244, abs=1e-3)


def test_uncertainty_by_count_has_the_median(fit_result, instrument):
    table = tables.uncertainty(fit_result, instrument)
    row = tables.uncertainty_by_count(table).iloc[0]
    same = table[
        (table["source_class"] == row["source_class"])
        & (table["kind"] == row["kind"])
        & (table["coordinate"] == row["coordinate"])
        & (table["n_obs"] == row["n_obs"])
    ]
    assert row["sigma_mas"] == pytest.approx(same["sigma_mas"].median())
    assert row["n"] == len(same)


def test_convergence_has_the_tolerance(fit_result):
    table = tables.convergence(fit_result)
    assert (table["tolerance"] == fit_result.settings.tolerance).all()


@pytest.mark.parametrize("order", [2, 3, 5, 8])
def test_distortion_agrees_with_the_legendre_sum_of_numpy(order):
    random = np.random.default_rng(order)
    pairs = [(d - k, k) for d in range(2, order + 1) for k in range(d + 1)]
    coefficients = random.normal(size=len(pairs))
    x, y = random.uniform(-1.0, 1.0, (2, 50))
    expected = np.zeros(50)
    for (k, n), value in zip(pairs, coefficients, strict=True):
        along_x, along_y = legendre.Legendre.basis(k), legendre.Legendre.basis(n)
        expected += value * (along_x(x) * along_y(y) - along_x(0.0) * along_y(0.0))
    assert np.allclose(displacement_um(coefficients, x, y), expected, atol=1e-12)


def test_distortion_is_zero_at_the_optical_centre(fit_result, instrument):
    table = tables.distortion(fit_result, instrument)
    centre = table[(table["x"] == 0.0) & (table["y"] == 0.0)]
    assert len(centre) == 1
    assert np.hypot(centre["dx_um"], centre["dy_um"]).iloc[0] < 1e-12
    assert np.hypot(table["dx_um"], table["dy_um"]).max() > 1.0


@pytest.mark.parametrize("order", [0, 1])
def test_orbit_without_distortion_terms_has_a_distortion_of_zero(fit_result, instrument, order):
    table = tables.distortion(without_distortion(fit_result, order), instrument)
    assert (table[["dx_um", "dy_um", "dx_mas", "dy_mas"]] == 0.0).all(axis=None)


def test_distortion_of_an_incomplete_order_is_refused():
    with pytest.raises(ValueError, match="complete order"):
        displacement_um(np.ones(4), np.zeros(1), np.zeros(1))


def test_distortion_without_coefficients_is_zero():
    assert (displacement_um(np.array([]), np.ones(3), np.ones(3)) == 0.0).all()


def test_pull_histogram_counts_every_residual(fit_result):
    table = tables.pull_histogram(fit_result, limit=2.0)
    for _, rows in table.groupby("axis"):
        assert rows["count"].sum() + rows["outside"].iloc[0] == len(fit_result.residuals)
        assert rows["expected"].sum() == pytest.approx(0.9545 * rows["n"].iloc[0], rel=1e-4)


def test_exposure_chi2_is_scaled_by_its_expected_scatter(fit_result):
    row = tables.exposure_chi2(fit_result).iloc[3]
    exposure = fit_result.exposures.iloc[3]
    assert row["expected_sd"] == pytest.approx(np.sqrt(2.0 / exposure["dof"]))
    assert row["z"] * row["expected_sd"] == pytest.approx(exposure["chi2"] / exposure["dof"] - 1)


def test_calibration_tables_name_units_and_cover_every_group(fit_result):
    found = tables.calibration_tables(fit_result)
    counts = {title: len(table) for title, table in found.items()}
    assert counts == {"Exposures": 12, "Detectors": 4, "Distortion": 18}
    assert "focal length [µm]" in found["Exposures"]
    assert "σ pointing RA, marginal [arcsec]" in found["Exposures"]
    assert found["Distortion"]["element"].iloc[0] == "A(2,0) B(2,0)"
    # The file of a result says "field 0 plate 0".
    assert found["Exposures"]["element"].iloc[0] == "field 0, exposure 0"
    assert fit_result.calibration["label"].str.contains("plate").any()


def test_exposures_have_one_name_in_all_tables_of_the_calibration(fit_result):
    shown = [
        tables.prior_shares(fit_result)["label"],
        tables.eigenmode_spectrum(fit_result)["name"],
        tables.eigenmode_deciders(fit_result)["name"],
        tables.eigenmode_groups(fit_result)["name"],
        tables.eigenmode_shifts(fit_result)["name"],
    ]
    assert not any(names.str.contains("plate").any() for names in shown)
    assert shown[0].str.fullmatch(r"field \d+, exposure \d+").any()
    assert list(element_labels(pd.Series(["pointing RA of field 3 plate 12", "A(2,0)", ""]))) == [
        "pointing RA of field 3, exposure 12",
        "A(2,0)",
        "",
    ]


def test_comparison_of_a_fit_with_itself_is_zero(fit_result):
    table = tables.comparison(fit_result, fit_result)
    assert len(table) == len(fit_result.sources)
    assert (table[["difference_ra_mas", "difference_dec_mas"]] == 0.0).all(axis=None)
    assert (table[["sigma_ratio_ra", "sigma_ratio_dec"]] == 1.0).all(axis=None)


def test_difference_histogram_includes_every_source(fit_result, make_fit_result):
    table = tables.comparison(fit_result, make_fit_result(2)[0])
    histogram = tables.difference_histogram(table)
    assert (histogram.groupby("coordinate")["count"].sum() == len(table)).all()
