"""Result files: lossless, in the published layout; other files are refused."""

import json
from dataclasses import fields, replace

import numpy as np
import pandas as pd
import pytest
from astropy.io import fits
from astropy.table import QTable

from solver.data import schema
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io import header
from solver.io.result import read_result, read_versions, write_result
from tests.solver.io_samples import (
    random_table,
    small_result,
    without_truth,
    write_fits,
    write_orbit,
)

PUBLISHED = {
    "RESULT": {
        "source_id": "",
        "src_a_loc": "deg",
        "src_a_sig": "deg",
        "src_d_loc": "deg",
        "src_d_sig": "deg",
        "ra_ref": "deg",
        "dec_ref": "deg",
        "num_measurement": "",
        "reference_flag": "",
        "src_a_marg": "deg",
        "src_d_marg": "deg",
        "src_ad_corr": "",
        "chi2": "",
        "dof": "",
        "is_artificial": "",
    },
    "SAMPLE": {
        **dict.fromkeys(("source_id", "detector_id", "orbit_id", "field_id", "plate_id"), ""),
        **dict.fromkeys(("nx", "ny", "ij_x", "ij_y", "xy_x", "xy_y", "pq_x", "pq_y"), ""),
        "sig_x_loc": "pix",
        "sig_y_loc": "pix",
    },
    "TELESCOPE": {
        **dict.fromkeys(("orbit_id", "field_id", "plate_id"), ""),
        **dict.fromkeys(("tel_a_loc", "tel_d_loc", "tel_t_loc"), "deg"),
        "tel_f_loc_x": "um",
        "tel_f_loc_y": "um",
    },
    "DETECTOR": dict.fromkeys(
        ("det_r_loc", "det_o_loc_x", "det_o_loc_y", "det_p_loc_x", "det_p_loc_y"), ""
    ),
    "DISTORTION": {"opt_A_loc": "", "opt_B_loc": ""},
    "TRACE": {"loss": ""},
}


@pytest.fixture(scope="module")
def result():
    return small_result()


@pytest.fixture(scope="module")
def written(tmp_path_factory, result):
    path = tmp_path_factory.mktemp("written") / "result.fits"
    write_result(result, path)
    return path


def _assert_equal(first, second):
    for item in fields(first):
        one, other = getattr(first, item.name), getattr(second, item.name)
        if isinstance(one, pd.DataFrame):
            pd.testing.assert_frame_equal(one, other, check_exact=True)
        else:
            assert one == other


def test_round_trip_is_exact(written, result):
    _assert_equal(read_result(written), result)


def test_round_trip_without_truth(tmp_path, result):
    path = tmp_path / "result.fits"
    write_result(without_truth(result), path)
    _assert_equal(read_result(path), without_truth(result))


def test_round_trip_with_the_losses_of_svi(tmp_path, result):
    losses = pd.DataFrame({"step": np.arange(1, 4), "loss": [3.5e9, -2.25, np.pi]})
    write_result(replace(result, losses=losses), tmp_path / "r.fits")
    pd.testing.assert_frame_equal(read_result(tmp_path / "r.fits").losses, losses)


def test_round_trip_with_outliers(tmp_path, result):
    outliers = random_table(schema.OUTLIERS, 3, np.random.default_rng(0))
    write_result(replace(result, outliers=outliers), tmp_path / "r.fits")
    pd.testing.assert_frame_equal(read_result(tmp_path / "r.fits").outliers, outliers)


@pytest.mark.parametrize("table", schema.EIGENMODE_TABLES, ids=lambda table: table.name)
@pytest.mark.parametrize("rows", [0, 3])
def test_round_trip_with_modes(tmp_path, result, table, rows):
    frame = random_table(table, 3, np.random.default_rng(0)).head(rows)
    write_result(replace(result, **{table.name: frame}), tmp_path / "r.fits")
    back = getattr(read_result(tmp_path / "r.fits"), table.name)
    pd.testing.assert_frame_equal(back, frame, check_exact=True)


def test_result_without_eigenmodes_has_none(written):
    back = read_result(written)
    assert [getattr(back, table.name) for table in schema.EIGENMODE_TABLES] == [None] * 3


def test_round_trip_with_the_orders_compared(tmp_path, result):
    orders = random_table(schema.ORDERS, 10, np.random.default_rng(0))
    orders.loc[3, "log_evidence"] = np.nan
    write_result(replace(result, orders=orders), tmp_path / "r.fits")
    pd.testing.assert_frame_equal(read_result(tmp_path / "r.fits").orders, orders)


def test_round_trip_without_distortion_or_trace(tmp_path, result):
    kept = ~result.calibration["group"].str.startswith("distortion")
    bare = replace(
        result,
        settings=FitSettings(order=0),
        calibration=result.calibration[kept].reset_index(drop=True),
        trace=result.trace[:0],
        provenance={},
    )
    path = tmp_path / "result.fits"
    write_result(bare, path)
    _assert_equal(read_result(path), bare)


def test_ids_are_exact(written, result):
    ids = read_result(written).sources["source_id"]
    assert ids.dtype == np.int64
    assert ids.tolist() == result.sources["source_id"].tolist()


def test_summary_keeps_types(written):
    summary = read_result(written).summary
    assert summary["converged"] is True
    assert isinstance(summary["iterations"], int)
    assert summary["log_evidence"] is None


def test_summary_must_be_plain(tmp_path, result):
    with pytest.raises(TypeError, match="plain numbers and text"):
        write_result(replace(result, summary={"a": object()}), tmp_path / "result.fits")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("hdu", PUBLISHED)
def test_published_columns_come_first_with_their_units(written, hdu):
    with fits.open(written) as hdus:
        columns = hdus[hdu].columns
        units = {column.name: column.unit or "" for column in columns}
    names = list(PUBLISHED[hdu])
    assert columns.names[: len(names)] == names
    assert {name: units[name] for name in names} == PUBLISHED[hdu]


def test_published_hdus_come_first(written):
    with fits.open(written) as hdus:
        assert [hdu.name for hdu in hdus][:7] == ["PRIMARY", *PUBLISHED]


def test_files_are_valid_fits(written):
    with fits.open(written, checksum=True) as hdus:
        hdus.verify("exception")
        assert all("CHECKSUM" in hdu.header and "DATASUM" in hdu.header for hdu in hdus)
    assert QTable.read(written, hdu="result")["src_a_loc"].unit == "deg"


@pytest.mark.parametrize(("suffix", "kind"), [("sig", "conditional"), ("marg", "marginal")])
def test_sigmas_are_in_degrees_of_the_coordinate(written, result, suffix, kind):
    table, sources = QTable.read(written, hdu="result"), result.sources
    cos_dec = np.cos(np.radians(sources["dec"]))
    for axis, letter, scale in (("ra", "a", cos_dec), ("dec", "d", 1.0)):
        expected = sources[f"sigma_{axis}_{kind}"] / 3.6e6 / scale
        found = table[f"src_{letter}_{suffix}"].to_value("deg")
        np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_sample_is_in_the_order_of_the_measurements(written, result):
    sample = fits.getdata(written, "SAMPLE")
    for name, column in (
        ("ij_x", "model_x"),
        ("xy_y", "focal_y"),
        ("pq_x", "ideal_x"),
        ("sig_y_loc", "sy"),
    ):
        np.testing.assert_array_equal(sample[name], result.residuals[column])


@pytest.mark.parametrize(
    ("hdu", "name", "group"),
    [
        ("TELESCOPE", "tel_a_loc", "pointing_ra"),
        ("TELESCOPE", "tel_f_loc_x", "focal_length"),
        ("TELESCOPE", "tel_f_loc_y", "focal_length"),
        ("DETECTOR", "det_r_loc", "detector_rotation"),
        ("DETECTOR", "det_p_loc_y", "pitch_y"),
        ("DISTORTION", "opt_A_loc", "distortion_x"),
        ("DISTORTION", "opt_B_loc", "distortion_y"),
    ],
)
def test_published_calibration_agrees_with_the_result(written, result, hdu, name, group):
    rows = result.calibration[result.calibration["group"] == group]
    np.testing.assert_array_equal(fits.getdata(written, hdu)[name], rows["value"])


def test_telescope_rows_have_exposure_ids(written, result):
    telescope = fits.getdata(written, "TELESCOPE")
    for name in ("orbit_id", "field_id", "plate_id"):
        np.testing.assert_array_equal(telescope[name], result.exposures[name])


def test_primary_header_has_provenance(written, result):
    cards = fits.getheader(written)
    assert (cards["ORIGIN"], cards["FORMAT"]) == ("plateviz", header.FORMAT)
    assert (cards["ENGINE"], cards["ORDER"], cards["ABERR"]) == ("gauss-newton", 5, True)
    assert cards["NUMPY"] == np.__version__
    assert all(cards[name] for name in ("PLATEVIZ", "JAX", "ASTROPY"))
    assert (cards["INPUT"], cards["INFILE1"]) == ("OBS.fits", "OBS.fits")
    assert [cards["INHASH1"], cards["INHASH2"]] == list(result.provenance.values())
    assert json.loads(cards["PRIORS"]) == result.settings.prior_widths


@pytest.mark.parametrize("hdu", ["PRIMARY", "RESULT"])
def test_headers_have_mean_epoch_and_uncertainties(written, result, hdu):
    cards = fits.getheader(written, hdu)
    assert cards["OBSTIME"] == pytest.approx(result.exposures["obstime"].mean(), abs=1e-9)
    assert cards["SIGMA_X"] == pytest.approx(result.residuals["sx"].mean())
    assert cards["SIGMA_Y"] == pytest.approx(result.residuals["sy"].mean())
    assert cards["SIGMA"] == pytest.approx((cards["SIGMA_X"] + cards["SIGMA_Y"]) / 2)


def test_result_header_has_the_loss_and_the_scatter_of_the_references(written, result):
    cards = fits.getheader(written, "RESULT")
    references = result.sources[result.sources["is_reference"]]
    deviation = references["offset_ra"] / references["prior_sigma_ra"]
    assert cards["LOSS"] == result.trace["objective"].iloc[-1]
    assert cards["SIGMA_RA"] == pytest.approx(deviation.std(ddof=0))


def test_version_of_a_package_that_is_not_installed(monkeypatch, tmp_path, result):
    monkeypatch.setattr(header, "_VERSIONS", {"PLATEVIZ": "no-such-package-anywhere"})
    write_result(result, tmp_path / "r.fits")
    assert fits.getheader(tmp_path / "r.fits")["PLATEVIZ"] == "unknown"


def test_overwrites_and_leaves_nothing_else(tmp_path, result):
    path = tmp_path / "result.fits"
    path.write_text("old")
    write_result(result, path, overwrite=True)
    _assert_equal(read_result(path), result)
    assert list(tmp_path.iterdir()) == [path]


def test_missing_folder(tmp_path, result):
    with pytest.raises(InputError, match="found no folder"):
        write_result(result, tmp_path / "none" / "r.fits")


def _edited(path, change):
    with fits.open(path) as hdus:
        change(hdus)
        hdus.writeto(path.with_name("edited.fits"), checksum=True, overwrite=True)
    return path.with_name("edited.fits")


def test_newer_format_is_refused(written):
    path = _edited(written, lambda hdus: hdus[0].header.set("FORMAT", header.FORMAT + 1))
    with pytest.raises(InputError, match=r"edited\.fits: expected a result of format 2 or older"):
        read_result(path)


@pytest.mark.parametrize("card", ["ORIGIN", "FORMAT"])
def test_file_of_another_program_is_refused(written, card):
    path = _edited(written, lambda hdus: hdus[0].header.remove(card))
    with pytest.raises(InputError, match=f"expected a result file, .*{card} = None"):
        read_result(path)


@pytest.mark.parametrize(
    "hdu", ["RESULT", "SAMPLE", "TRACE", "CALIBRATION", "EXPOSURES", "SUMMARY"]
)
def test_incomplete_file_is_refused(written, hdu):
    path = _edited(written, lambda hdus: hdus.pop(hdu))
    with pytest.raises(InputError, match=f"expected an HDU {hdu} in a result file"):
        read_result(path)


def test_missing_optional_table_is_refused(written):
    path = _edited(written, lambda hdus: hdus.pop("TRUE_PLACES"))
    with pytest.raises(InputError, match=r"edited\.fits: expected 10 tables, .* found 9"):
        read_result(path)


def test_result_of_an_older_version_has_no_number_of_tables(written):
    def change(hdus):
        del hdus[0].header["NTABLES"]
        hdus.pop("TRUE_PLACES")

    assert read_result(_edited(written, change)).true_places is None


def test_result_of_an_older_version_has_uncorrelated_priors(written, result):
    path = _edited(written, lambda hdus: hdus["RESULT"].columns.del_col("prior_corr"))
    sources = read_result(path).sources
    assert list(sources.columns) == list(result.sources.columns)
    assert (sources["prior_corr"] == 0.0).all()


def test_missing_column_is_refused(written):
    path = _edited(written, lambda hdus: hdus["RESULT"].columns.del_col("src_a_loc"))
    with pytest.raises(InputError, match="HDU RESULT: .*found none called src_a_loc"):
        read_result(path)


def test_column_of_another_type_is_refused(written):
    def change(hdus):
        table = QTable.read(hdus["EXPOSURES"])
        table["n_obs"] = table["n_obs"].astype(float)
        hdus["EXPOSURES"] = fits.table_to_hdu(table)
        hdus[8].name = "EXPOSURES"

    with pytest.raises(InputError, match="HDU EXPOSURES, column for n_obs: expected int64, found"):
        read_result(_edited(written, change))


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("source_id", "column source_id: expected ids of HDU RESULT, found 1 that .* have: 77"),
        ("plate_id", r"columns field_id and plate_id: .* of HDU EXPOSURES, .* have: \(0, 77\)"),
        ("detector_id", "column detector_id: .* of the instrument of the fit, .* have: 77"),
    ],
)
def test_residual_of_what_the_result_does_not_have_is_refused(written, column, message):
    def change(hdus):
        hdus["SAMPLE"].data[column][5] = 77

    with pytest.raises(InputError, match=f"HDU SAMPLE, {message}"):
        read_result(_edited(written, change))


def test_result_without_residuals_is_refused(written):
    def change(hdus):
        hdus["SAMPLE"].data = hdus["SAMPLE"].data[:0]

    with pytest.raises(InputError, match="HDU SAMPLE: expected a residual .* found no row"):
        read_result(_edited(written, change))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [("order", "77", "from 0 to 9, found 77"), ("order", "nonsense", "HDU SUMMARY: expected")],
)
def test_wrong_settings_are_refused(written, key, value, message):
    def change(hdus):
        table = QTable.read(hdus["SUMMARY"])
        row = (table["section"] == "settings") & (table["key"] == key)
        table["value"][row] = value
        hdus["SUMMARY"].data = fits.table_to_hdu(table).data

    with pytest.raises(InputError, match=message):
        read_result(_edited(written, change))


@pytest.mark.parametrize("hdu", range(1, 4))
def test_flipped_byte_is_refused(tmp_path, written, hdu):
    content = bytearray(written.read_bytes())
    with fits.open(written) as hdus:
        first = hdus.fileinfo(hdu)["datLoc"]
    content[first + 40] ^= 4
    path = tmp_path / "flipped.fits"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"flipped\.fits, HDU \w+: expected"):
        read_result(path)


@pytest.mark.parametrize("read", [read_result, read_versions])
def test_flipped_byte_of_the_primary_header_is_refused(tmp_path, written, read):
    content = bytearray(written.read_bytes())
    content[content.index(b"NUMPY   = '") + 11] ^= 1
    path = tmp_path / "flipped.fits"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"flipped\.fits, HDU PRIMARY: expected .* corrupt"):
        read(path)


@pytest.mark.parametrize("read", [read_result, read_versions])
def test_card_that_cannot_be_parsed_is_refused(tmp_path, written, read):
    path = tmp_path / "card.fits"
    with fits.open(written) as hdus:
        for card in ("CHECKSUM", "DATASUM"):
            hdus[0].header.remove(card)
        hdus.writeto(path)
    content = path.read_bytes()
    start = content.index(b"NUMPY   = '")
    path.write_bytes(content[:start] + b"NUMPY   = 'no end".ljust(80) + content[start + 80 :])
    with pytest.raises(InputError, match=r"card\.fits: expected a FITS file, found Unparsable"):
        read(path)


def test_observation_is_refused_as_a_result(tmp_path):
    obs, _ = write_orbit(tmp_path)
    with pytest.raises(InputError, match="expected a result file, with ORIGIN = 'plateviz'"):
        read_result(obs)


def test_missing_result(tmp_path):
    with pytest.raises(InputError, match="expected a result file, found none"):
        read_result(tmp_path / "none.fits")


def test_fits_without_tables_is_refused_as_a_result(tmp_path):
    with pytest.raises(InputError, match="expected a result file"):
        read_result(write_fits(tmp_path / "empty.fits"))
