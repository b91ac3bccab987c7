"""Tables of the Gaia archive as a truth: formats, units, spellings and correlations."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from astropy import units as u
from astropy.io import fits
from astropy.io.votable import from_table
from astropy.table import MaskedColumn, Table
from pyarrow import parquet

from solver.data.schema import CATALOGUE, TRUTH
from solver.errors import InputError
from solver.io.read_orbit import find_catalogue
from solver.io.survey import read_survey_orbit
from solver.model.correlation import ASTROMETRY, CORRELATIONS, correlation_matrices, square_roots
from solver.simulate.catalogue import reference_catalogue, truth_catalogue, truth_from_gaia
from solver.simulate.gaia import GAIA, gaia_stars
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

SETTINGS = SurveySettings(orbits=1, n_stars=3000, n_reference=1500, n_artificial=40)
N_INCOMPLETE = 7
# A loading matrix gives a valid correlation matrix of five parameters.
LOADINGS = np.array([[1, 0.4], [-0.3, 1], [0.9, -0.5], [0.2, 0.7], [-0.6, -0.1]])


def correlated_matrix():
    covariance = LOADINGS @ LOADINGS.T + 0.5 * np.eye(5)
    sigma = np.sqrt(np.diag(covariance))
    return covariance / np.outer(sigma, sigma)


def with_correlations(frame, matrix):
    pairs = zip(*np.triu_indices(5, 1), strict=True)
    return frame.assign(**{n: matrix[i, j] for n, (i, j) in zip(CORRELATIONS, pairs, strict=True)})


@pytest.fixture(scope="module")
def stars():
    truth = truth_catalogue(replace(SETTINGS, n_artificial=0, seed=3))
    frame = truth.drop(columns=["is_reference", "is_artificial"])
    return with_correlations(frame, correlated_matrix())[GAIA.names]


@pytest.fixture
def archive(stars):
    """The same stars as in the archive: with units, a text column and stars without parallax."""
    table = Table.from_pandas(stars)
    for column in GAIA:
        table[column.name].unit = column.unit or None
    gaps = np.zeros(len(table), dtype=bool)
    gaps[:N_INCOMPLETE] = True
    for name in ("parallax", "parallax_error", "pmra", "pmdec", "ra_parallax_corr"):
        table[name] = MaskedColumn(table[name], mask=gaps)
    table["designation"] = [f"Gaia DR3 {number}" for number in stars["source_id"]]
    return table


def write_ecsv_with_nulls(table, path):
    table = table.filled(-999.0)
    table.write(path, format="ascii.ecsv")
    path.write_text(path.read_text("utf-8").replace("-999.0", "null"), "utf-8")


def write_csv_with_nulls(table, path):
    table.to_pandas().to_csv(path, index=False, na_rep="null")


WRITERS = {
    ".fits": lambda table, path: fits.BinTableHDU(table).writeto(path),
    ".vot": lambda table, path: table.write(path, format="votable"),
    ".xml": lambda table, path: from_table(table).to_xml(str(path), tabledata_format="binary2"),
    ".ecsv": write_ecsv_with_nulls,
    ".parquet": lambda table, path: table.write(path, format="parquet"),
    ".csv": write_csv_with_nulls,
}


def written(table, path):
    WRITERS[path.suffix](table, path)
    return path


def read(path):
    located = find_catalogue(path)
    return gaia_stars(located.table, located.where)


@pytest.mark.parametrize("suffix", WRITERS)
def test_archive_tables_are_read_from_every_format(suffix, stars, archive, tmp_path):
    found = read(written(archive, tmp_path / f"gaia{suffix}"))
    pd.testing.assert_frame_equal(found, stars.iloc[N_INCOMPLETE:].reset_index(drop=True))


@pytest.mark.parametrize("suffix", WRITERS)
def test_column_names_may_be_in_upper_case(suffix, stars, archive, tmp_path):
    archive.rename_columns(archive.colnames, [name.upper() for name in archive.colnames])
    found = read(written(archive, tmp_path / f"gaia{suffix}"))
    assert list(found) == GAIA.names
    assert found["source_id"].tolist() == stars["source_id"].tolist()[N_INCOMPLETE:]


@pytest.mark.parametrize("suffix", [s for s in WRITERS if s != ".csv"])
def test_other_units_are_converted(suffix, stars, archive, tmp_path):
    archive["ra"].convert_unit_to(u.rad)
    archive["dec"].convert_unit_to(u.arcsec)
    archive["ra_error"].convert_unit_to(u.deg)
    archive["parallax"].convert_unit_to(u.uas)
    archive["pmra_error"].convert_unit_to(u.arcsec / u.yr)
    found = read(written(archive, tmp_path / f"gaia{suffix}"))
    expected = stars.iloc[N_INCOMPLETE:].reset_index(drop=True)
    pd.testing.assert_frame_equal(found, expected, rtol=1e-14)


def test_units_of_old_votables_are_read(stars, archive, tmp_path):
    document = from_table(archive)
    document.version = "1.3"
    document.to_xml(str(tmp_path / "gaia.vot"))
    text = (tmp_path / "gaia.vot").read_text("utf-8")
    (tmp_path / "gaia.vot").write_text(text.replace("mas.yr-1", "mas.yr**-1"), "utf-8")
    assert "mas.yr**-1" in (tmp_path / "gaia.vot").read_text("utf-8")
    found = read(tmp_path / "gaia.vot")
    np.testing.assert_array_equal(found["pmra"], stars["pmra"].iloc[N_INCOMPLETE:])


def test_single_precision_of_the_archive_is_kept(stars, archive):
    for name in ("parallax_error", *CORRELATIONS):
        archive[name] = archive[name].astype(np.float32)
    found = gaia_stars(archive, "gaia.fits")
    np.testing.assert_array_equal(
        found["ra_dec_corr"], stars["ra_dec_corr"].iloc[N_INCOMPLETE:].astype(np.float32)
    )


def test_absent_correlations_are_zero(stars):
    found = gaia_stars(stars.drop(columns=["ra_pmra_corr"]), "gaia.csv")
    assert (found["ra_pmra_corr"] == 0.0).all()
    np.testing.assert_array_equal(found["ra_dec_corr"], stars["ra_dec_corr"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.assign(parallax=np.nan), "my.csv: expected a row .* found none among 3000"),
        (lambda s: s.assign(dec=s["dec"] - 90.0), "'dec': expected values from -90"),
        (lambda s: s.assign(ra=s["ra"].astype(np.float32)), "'ra': expected float64"),
        (lambda s: s.assign(ra_dec_corr=1.5), "'ra_dec_corr': expected values from -1 to 1"),
        (lambda s: s.iloc[:0], "expected at least one row, found none"),
    ],
    ids=["all-gaps", "declination", "precision", "correlation", "empty"],
)
def test_invalid_values_are_refused(change, message, stars):
    with pytest.raises(InputError, match=message):
        gaia_stars(change(stars), "my.csv")


def test_message_counts_complete_rows(archive):
    archive["dec"][N_INCOMPLETE + 2] = -100.0
    with pytest.raises(InputError, match="gaia.fits, its 2993 complete rows.*is row 3"):
        gaia_stars(archive, "gaia.fits")


def test_inconsistent_correlations_are_refused(stars):
    with pytest.raises(InputError, match=r"my\.csv, columns \*_corr: .* in 1500 reference stars"):
        truth_from_gaia(
            stars.assign(ra_dec_corr=0.9, ra_parallax_corr=0.9, dec_parallax_corr=-0.9),
            SETTINGS,
            "my.csv",
        )


def test_square_roots_reproduce_the_matrices(stars):
    matrices = correlation_matrices(stars.iloc[:3])
    np.testing.assert_allclose(matrices, np.tile(correlated_matrix(), (3, 1, 1)))
    roots = square_roots(matrices)
    np.testing.assert_allclose(roots @ roots, matrices, atol=1e-14)
    np.testing.assert_allclose(roots, roots.transpose(0, 2, 1), atol=1e-15)


def test_full_correlation_has_a_square_root():
    roots = square_roots(np.ones((1, 5, 5)))
    np.testing.assert_allclose(roots @ roots, np.ones((1, 5, 5)), atol=1e-14)


def pulls(truth, reference):
    """Reference minus truth in units of its uncertainty, columns as `ASTROMETRY`."""
    factor = {"ra": 3.6e6 * np.cos(np.radians(truth["dec"])), "dec": 3.6e6}
    columns = [
        (reference[n] - truth[n]) * factor.get(n, 1.0) / reference[f"{n}_error"] for n in ASTROMETRY
    ]
    return np.stack(columns, axis=-1)


def test_reference_stars_scatter_with_the_correlations_of_their_errors(stars):
    truth = truth_from_gaia(stars, SETTINGS)
    reference = reference_catalogue(truth, SETTINGS)
    chosen = truth["is_reference"].to_numpy()
    matrix = correlated_matrix()
    # The sampling error of a correlation among 1,500 stars is at most 0.026.
    found = np.cov(pulls(truth, reference)[chosen].T)
    np.testing.assert_allclose(found, matrix, atol=0.13)
    assert np.abs(matrix - np.eye(5)).max() > 0.5
    assert list(reference) == CATALOGUE.names
    np.testing.assert_array_equal(
        reference.loc[chosen, list(CORRELATIONS)], truth.loc[chosen, list(CORRELATIONS)]
    )


def test_correlations_do_not_change_other_sources(stars):
    with_them, without = (
        reference_catalogue(truth_from_gaia(table, SETTINGS), SETTINGS)
        for table in (stars, stars.drop(columns=list(CORRELATIONS)))
    )
    other = ~with_them["is_reference"]
    pd.testing.assert_frame_equal(with_them[other], without[other])
    assert (without[list(CORRELATIONS)] == 0.0).all(axis=None)
    assert not np.isin(with_them.loc[~other, "ra"], without.loc[~other, "ra"]).any()


def test_stars_without_correlations_are_drawn_as_synthetic_ones(stars):
    synthetic = truth_catalogue(SETTINGS)
    table = synthetic.query("~is_artificial").drop(columns=["is_reference", "is_artificial"])
    truth = truth_from_gaia(table, SETTINGS)
    pd.testing.assert_frame_equal(
        reference_catalogue(truth, SETTINGS), reference_catalogue(truth[TRUTH.names], SETTINGS)
    )


def test_survey_stores_correlations_only_in_the_reference_catalogue(archive, tmp_path):
    table = written(archive, tmp_path / "gaia.fits")
    simulate_survey(tmp_path / "survey", SETTINGS, catalogue=table)
    names = [name for name in TRUTH.names if name != "magnitude"]
    assert parquet.read_schema(tmp_path / "survey" / "truth.parquet").names == names
    catalogue = read_survey_orbit(tmp_path / "survey", 0).catalogue
    chosen = catalogue["is_reference"]
    assert chosen.any()
    expected = with_correlations(catalogue[chosen], correlated_matrix())
    pd.testing.assert_frame_equal(catalogue[chosen], expected)
    assert (catalogue.loc[~chosen, list(CORRELATIONS)] == 0.0).all(axis=None)


def test_magnitudes_are_those_of_the_archive_and_only_where_asked_for(archive):
    settings = replace(SETTINGS, magnitudes=True)
    archive["PHOT_G_MEAN_MAG"] = np.linspace(10.0, 19.0, len(archive)).astype(np.float32)
    truth = truth_from_gaia(archive, settings)
    own = dict(zip(archive["source_id"], archive["PHOT_G_MEAN_MAG"], strict=True))
    stars = truth[~truth["is_artificial"]]
    np.testing.assert_allclose(stars["magnitude"], [own[one] for one in stars["source_id"]])
    assert truth["magnitude"].notna().all()
    assert truth_from_gaia(archive, SETTINGS)["magnitude"].isna().all()


def test_table_without_the_magnitudes_asked_for_is_refused(archive):
    with pytest.raises(InputError, match="my table: expected a column phot_g_mean_mag"):
        truth_from_gaia(archive, replace(SETTINGS, defects=("charge-transfer=5mpix",)), "my table")
