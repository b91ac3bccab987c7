"""Raw tables: all formats give the same values, and damaged files raise InputError."""

import re
import zlib

import numpy as np
import pyarrow as pa
import pytest
from astropy.io import fits
from astropy.table import MaskedColumn, Table
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyarrow import parquet

from solver.errors import InputError
from solver.io.failures import reading
from solver.io.formats import read_tables
from solver.io.limits import MAX_ROWS
from tests.solver.io_samples import catalogue, measurement, write_fits, write_orbit, write_table

SUFFIXES = (".fits", ".ecsv", ".csv", ".parquet", ".xml", ".vot", ".votable")


def _write(table, path):
    if path.suffix in (".vot", ".votable"):
        table.write(path, format="votable")
        return path
    return write_table(table, path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_formats_read_the_same_values(tmp_path, suffix):
    table = catalogue()
    (read,) = read_tables(_write(table, tmp_path / f"stars{suffix}")).values()
    assert read.colnames == table.colnames
    for name in table.colnames:
        np.testing.assert_array_equal(read[name], table[name])
        assert read[name].dtype.isnative


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if s != ".csv"])
def test_formats_keep_units(tmp_path, suffix):
    (read,) = read_tables(_write(catalogue(), tmp_path / f"stars{suffix}")).values()
    assert read["pmra"].unit == catalogue()["pmra"].unit
    assert read["source_id"].unit is None


@pytest.mark.parametrize("suffix", [".csv", ".ecsv", ".parquet"])
def test_single_tables_have_the_name_of_the_file(tmp_path, suffix):
    assert list(read_tables(write_table(catalogue(), tmp_path / f"stars{suffix}"))) == ["stars"]


def test_fits_tables_have_their_names_or_numbers(tmp_path):
    path = write_fits(tmp_path / "a.fits", measurement=measurement(), **{"": catalogue()})
    assert list(read_tables(path)) == ["MEASUREMENT", "hdu2"]


def test_parquet_of_another_writer_keeps_units_ids_and_nulls(tmp_path):
    ids = pa.array([4057000000000003911, None], pa.int64())
    schema = pa.schema(
        [pa.field("source_id", pa.int64()), pa.field("ra", pa.float64(), metadata={"unit": "rad"})]
    )
    parquet.write_table(pa.table([ids, [1.0, 2.0]], schema=schema), tmp_path / "a.parquet")
    table = read_tables(tmp_path / "a.parquet")["a"]
    assert table["source_id"].dtype == np.int64
    assert table["source_id"][0] == 4057000000000003911
    assert table["source_id"].mask.tolist() == [False, True]
    assert table["ra"].unit == "rad"


def test_parquet_of_pandas_with_categories_and_lists(tmp_path):
    table = pa.table(
        {"a": pa.array(["x", "y"]).dictionary_encode(), "b": [[1], [2, 3]], "c": [None, None]}
    )
    parquet.write_table(table, tmp_path / "a.parquet")
    read = read_tables(tmp_path / "a.parquet")["a"]
    assert read["a"].tolist() == ["x", "y"]
    assert read["c"].mask.all()


def test_csv_with_comments_and_spaces(tmp_path):
    (tmp_path / "a.csv").write_text("# made by hand\nsource_id, ra\n4057000000000003911, 1.5\n")
    table = read_tables(tmp_path / "a.csv")["a"]
    assert table["source_id"][0] == 4057000000000003911
    assert table["ra"][0] == 1.5


def test_ecsv_called_csv(tmp_path):
    write_table(catalogue(), tmp_path / "a.ecsv").rename(tmp_path / "a.csv")
    assert read_tables(tmp_path / "a.csv")["a"]["ra"].unit == "deg"


def test_fits_null_logical_is_masked(tmp_path):
    path = write_fits(tmp_path / "a.fits", catalogue=catalogue())
    with fits.open(path, mode="update") as hdus:
        hdus[1].data.view(np.ndarray)["is_reference"][1] = 0
        for hdu in hdus:
            hdu.header.remove("CHECKSUM", ignore_missing=True)
            hdu.header.remove("DATASUM", ignore_missing=True)
    assert np.ma.getmaskarray(read_tables(path)["CATALOGUE"]["is_reference"]).sum() == 1


def test_fits_null_integer_is_masked(tmp_path):
    table = Table({"source_id": MaskedColumn([1, 2], mask=[False, True], fill_value=-1)})
    read = read_tables(write_fits(tmp_path / "a.fits", a=table))["A"]
    assert read["source_id"].mask.tolist() == [False, True]


@pytest.mark.parametrize(
    "content", [b"", bytes(5760), b"plain text\nof two lines\n", b"\x1f\x8b\x08"]
)
@pytest.mark.parametrize("suffix", [".fits", ".parquet", ".xml", ".ecsv"])
def test_not_a_table_file(tmp_path, suffix, content):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"a\{suffix}\b.*: expected .*found") as refused:
        read_tables(path)
    assert not re.search(r"\w(Error|Exception|Invalid)\b", str(refused.value))


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (KeyError("x"), r"damaged contents \('x'\)$"),
        (EOFError(), "damaged contents$"),
        (MemoryError(), "a size that does not fit into the memory$"),
        (OSError("Bad. TProtocolException: Invalid data"), "Bad. Invalid data$"),
    ],
    ids=repr,
)
def test_error_of_a_library_is_put_in_words(error, words):
    with (
        pytest.raises(InputError, match=rf"a\.xml: expected a table, found {words}"),
        reading("a.xml", "a table"),
    ):
        raise error


def test_empty_csv(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"")
    with pytest.raises(InputError, match=r"a\.csv: expected comma-separated values.*[Ee]mpty"):
        read_tables(tmp_path / "a.csv")


def test_csv_with_a_long_line(tmp_path):
    (tmp_path / "a.csv").write_text("a,b\n1,2,3\n")
    with pytest.raises(InputError, match="Expected 2 columns, got 3"):
        read_tables(tmp_path / "a.csv")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_repeated_column_name(tmp_path, suffix):
    if suffix == ".csv":
        (tmp_path / "a.csv").write_text("a,b,a\n1,2,3\n")
    else:
        both = pa.Table.from_arrays([pa.array([1]), pa.array([2])], names=["a", "a"])
        parquet.write_table(both, tmp_path / "a.parquet")
    with pytest.raises(InputError, match="each column name once, found repeated: a"):
        read_tables(tmp_path / f"a{suffix}")


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"a\.fits: expected a file, found none"):
        read_tables(tmp_path / "a.fits")


@pytest.mark.parametrize("name", ["a.fits.gz", "a.xlsx", "a"])
def test_unknown_suffix(tmp_path, name):
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(InputError, match=r"expected a suffix out of \.fits, .*found"):
        read_tables(tmp_path / name)


def test_compressed_fits_is_refused(tmp_path):
    (tmp_path / "a.fits").write_bytes(zlib.compress(bytes(10**6), wbits=31))
    with pytest.raises(InputError, match="expected an uncompressed FITS header"):
        read_tables(tmp_path / "a.fits")


def test_two_fits_tables_of_one_name(tmp_path):
    path = tmp_path / "a.fits"
    hdus = [fits.table_to_hdu(catalogue()) for _ in range(2)]
    for hdu in hdus:
        hdu.name = "same"
    fits.HDUList([fits.PrimaryHDU(), *hdus]).writeto(path)
    with pytest.raises(InputError, match="HDU 2: expected each HDU name once, found SAME"):
        read_tables(path)


@pytest.mark.parametrize("keep", [2000, 3000, 4000, 8000, -3000, -2881])
def test_truncated_fits(tmp_path, keep):
    obs, _ = write_orbit(tmp_path)
    obs.write_bytes(obs.read_bytes()[:keep])
    with pytest.raises(InputError, match=r"OBS\.fits.*expected.*found"):
        read_tables(obs)


def test_flipped_byte_under_a_checksum(tmp_path):
    obs, _ = write_orbit(tmp_path)
    with fits.open(obs) as hdus:
        offset = hdus["environment"].fileinfo()["datLoc"]
    content = bytearray(obs.read_bytes())
    content[offset + 40] ^= 1
    obs.write_bytes(content)
    with pytest.raises(InputError, match=r"OBS\.fits, HDU ENVIRONMENT: .*DATASUM.*corrupt"):
        read_tables(obs)


def _with_card(path, hdu_name, card):
    """Overwrite one header card of a FITS file in place."""
    with fits.open(path) as hdus:
        start = hdus[hdu_name].fileinfo()["hdrLoc"]
    content = bytearray(path.read_bytes())
    offset = content.index(card[:8].encode(), start)
    content[offset : offset + 80] = card.ljust(80).encode()
    path.write_bytes(content)


@pytest.mark.parametrize(
    "card",
    [
        "NAXIS2  =           1000000000",
        "NAXIS2  =                'abc'",
        "NAXIS2  =                   -4",
        "TFIELDS =                  999",
        "TFORM6  = '999999999D'",
        "TFORM6  = 'Z       '",
        "PCOUNT  =          10000000000",
        "DATASUM = 'abc     '",
    ],
)
def test_wrong_header_is_refused(tmp_path, card):
    obs, _ = write_orbit(tmp_path)
    _with_card(obs, "measurement", card)
    with pytest.raises(InputError, match=r"OBS\.fits"):
        read_tables(obs)


def test_huge_row_count_names_hdu_expected_and_found(tmp_path):
    obs, _ = write_orbit(tmp_path)
    _with_card(obs, "measurement", "NAXIS2  =           1000000000")
    expected = r"HDU MEASUREMENT: expected 72000000000 bytes of data .* found \d+"
    with pytest.raises(InputError, match=expected):
        read_tables(obs)


def test_rows_without_bytes_are_limited(tmp_path):
    table = Table({"a": [1]})
    path = write_fits(tmp_path / "a.fits", a=table)
    _with_card(path, "a", "NAXIS1  =                    0")
    _with_card(path, "a", f"NAXIS2  = {MAX_ROWS + 1:20d}")
    with pytest.raises(InputError, match=f"expected at most {MAX_ROWS} rows"):
        read_tables(path)


def test_bytes_after_the_last_hdu(tmp_path):
    obs, _ = write_orbit(tmp_path)
    obs.write_bytes(obs.read_bytes() + b"x" * 2880)
    with pytest.raises(InputError, match=r"OBS\.fits"):
        read_tables(obs)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        ('<!DOCTYPE a [<!ENTITY b "c">]><VOTABLE/>', "without entity declarations"),
        ('<VOTABLE><STREAM href="file:///etc/hostname"/></VOTABLE>', "plain data inside"),
        ('<v:VOTABLE xmlns:v="x"><v:STREAM encoding="gzip"/></v:VOTABLE>', "plain data inside"),
    ],
    ids=["entity", "external", "compressed"],
)
def test_hostile_votable(tmp_path, content, found):
    (tmp_path / "a.xml").write_text(content)
    with pytest.raises(InputError, match=found):
        read_tables(tmp_path / "a.xml")


@pytest.fixture(scope="module")
def seeds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("seeds")
    small = catalogue()[:2]["source_id", "ra", "is_reference"]
    small.write(folder / "a.fits")
    for suffix in (".ecsv", ".csv", ".parquet", ".xml"):
        write_table(small, folder / f"a{suffix}")
    return folder


@pytest.mark.parametrize("suffix", [".fits", ".ecsv", ".csv", ".parquet", ".xml"])
@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_files_are_read_or_refused(seeds, suffix, data):
    content = bytearray((seeds / f"a{suffix}").read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content))) :]
    path = seeds / f"damaged{suffix}"
    path.write_bytes(content)
    try:
        tables = read_tables(path)
    except InputError as error:
        named = path.name in str(error)
    else:
        named = all(isinstance(table, Table) for table in tables.values())
    assert named


def test_ecsv_with_an_endless_field_is_refused_in_words(tmp_path):
    head = (
        "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: a, datatype: string}\n# schema: astropy-2.0\n"
    )
    (tmp_path / "a.ecsv").write_text(f"{head}a\n{'x' * 200_000}\n")
    with pytest.raises(InputError, match=r"a\.ecsv: expected an ECSV table, found"):
        read_tables(tmp_path / "a.ecsv")


@pytest.mark.parametrize("size", ["100000000", "10000x10000", "100000000*"])
def test_votable_with_enormous_cells_is_refused_in_words(tmp_path, size):
    path = write_table(catalogue(), tmp_path / "a.xml")
    path.write_text(path.read_text().replace("<FIELD ", f'<FIELD arraysize="{size}" ', 1))
    with pytest.raises(InputError, match="expected at most 10000 values in a cell"):
        read_tables(path)
