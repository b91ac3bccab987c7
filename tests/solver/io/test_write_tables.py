"""Tables in files of every format are read back as they were."""

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Column, Table

from solver.io.formats import read_tables
from solver.io.write_tables import OF_ONE_TABLE, SUFFIXES, write_tables


@pytest.fixture
def table():
    return Table(
        {
            "source_id": Column(np.array([1, 2**62 + 1]), description="id of the source"),
            "ra": Column(np.array([0.1, 1.0 / 3.0]), unit="deg", description="right ascension"),
            "is_reference": [True, False],
            "source_class": ["reference", "a, b"],
        }
    )


def require_equal(found, table):
    assert found.colnames == table.colnames
    for name in table.colnames:
        assert np.array_equal(np.asarray(found[name]), np.asarray(table[name])), name


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_table_is_read_back_equal(table, tmp_path, suffix):
    path = tmp_path / f"sources{suffix}"
    write_tables({"sources": table}, path)
    (found,) = read_tables(path).values()
    require_equal(found, table)
    if suffix != ".csv":
        assert found["ra"].unit == table["ra"].unit
    if suffix == ".fits":
        assert fits.getheader(path, 1)["TCOMM1"] == "id of the source"
    elif suffix != ".csv":
        assert found["source_id"].description == "id of the source"


@pytest.mark.parametrize("suffix", sorted(set(SUFFIXES) - set(OF_ONE_TABLE)))
def test_several_tables_are_read_back_by_name(table, tmp_path, suffix):
    path = tmp_path / f"both{suffix}"
    write_tables({"sources": table, "others": table[:1]}, path)
    found = {name.lower(): one for name, one in read_tables(path).items()}
    assert sorted(found) == ["others", "sources"]
    require_equal(found["sources"], table)
    require_equal(found["others"], table[:1])


@pytest.mark.parametrize("suffix", OF_ONE_TABLE)
def test_several_tables_need_a_format_that_has_names(table, tmp_path, suffix):
    path = tmp_path / f"both{suffix}"
    with pytest.raises(ValueError, match="too many"):
        write_tables({"sources": table, "others": table}, path)
    assert not path.exists()
