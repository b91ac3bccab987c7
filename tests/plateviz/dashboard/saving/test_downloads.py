"""Files that a person takes out of the dashboard are read back with equal values."""

import io
import zipfile

import numpy as np
import pandas as pd
import pytest
from astropy.io import fits
from astropy.table import Column, Table

from plateviz.dashboard.saving.downloads import FORMATS, as_file, described, rows_of
from plateviz.tables.explore import EXPLORABLE
from solver.data.survey_schema import MOTIONS
from solver.errors import InputError
from solver.io.formats import read_tables


def read_back(made, folder):
    """Return the tables of a file by name, those of an archive by the names of its files."""
    if not made.name.endswith(".zip"):
        path = folder / made.name
        path.write_bytes(made.content)
        return {name.lower(): table for name, table in read_tables(path).items()}
    with zipfile.ZipFile(io.BytesIO(made.content)) as archive:
        archive.extractall(folder)
        names = archive.namelist()
    return {name: table for file in names for name, table in read_tables(folder / file).items()}


@pytest.mark.parametrize("suffix", FORMATS.values(), ids=list(FORMATS))
def test_rows_of_a_solution_are_read_back_equal(fit_result, tmp_path, suffix):
    tables = {}
    for name, make in EXPLORABLE.items():
        table = make(fit_result)
        tables[name] = rows_of(table, np.arange(table.size) % 7 == 0)
    found = read_back(as_file(tables, "orbit-0 selection", suffix), tmp_path)
    assert sorted(found) == sorted(tables)
    for name, table in tables.items():
        assert found[name].colnames == table.colnames
        for column in table.colnames:
            values = np.asarray(found[name][column])
            assert np.array_equal(
                values, np.asarray(table[column]), equal_nan=values.dtype.kind == "f"
            )


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        ("run-../../a b\n<i>", "run-..-..-a-b-i-.csv"),
        ("../.bashrc", "bashrc.csv"),
        ("orbit-3-été", "orbit-3-été.csv"),
    ],
)
def test_name_of_a_file_is_harmless(stem, name):
    assert as_file({"a": Table({"x": [1.0]})}, stem, ".csv").name == name


def test_fits_has_escapes_for_other_characters_than_ascii(tmp_path):
    table = Table({"x": Column([1.0], description="\u0394x (\u00b5as)"), "name": ["\u03b1 Cen"]})
    made = as_file({"a": table}, "a", ".fits")
    (found,) = read_back(made, tmp_path).values()
    assert found["name"][0] == "\\u03b1 Cen"
    assert fits.getheader(tmp_path / made.name, 1)["TCOMM1"] == "\\u0394x (\\xb5as)"


def test_nothing_is_not_saved():
    with pytest.raises(InputError, match="nothing to save: no row is shown"):
        as_file({"a": Table({"x": []})}, "a", ".csv")


def test_columns_of_the_definition_have_units_and_meanings():
    made = described(pd.DataFrame({"source_id": [2**62 + 1], "other": [1.0]}), MOTIONS)
    assert made.colnames == ["source_id"]
    assert made["source_id"][0] == 2**62 + 1
    assert made["source_id"].description == MOTIONS["source_id"].meaning


def test_ids_that_a_run_reads_as_float32_are_saved_as_whole_numbers(fit_result):
    table = EXPLORABLE["measurements"](fit_result)
    numbers = {name: table.read(name).astype(np.float32) for name in table.columns}
    of_run = table._replace(read=lambda name: numbers.get(name, table.read(name)))
    saved = rows_of(of_run, np.arange(5), ["detector_id", "residual_x"])
    assert saved["detector_id"].dtype == np.int64
    assert saved["detector_id"].tolist() == table.read("detector_id")[:5].tolist()
    assert saved["residual_x"].dtype == np.float32
