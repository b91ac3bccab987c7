"""Tables of a run for Explore: columns read one by one are those of its orbits."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from pyarrow import parquet

from plateviz.runs import explorable
from plateviz.runs.column_cache import ColumnCache
from plateviz.runs.explorable import COLUMNS_OF_RUN, explorable_of_run
from plateviz.runs.gathered_history import gather_history
from plateviz.runs.new_run import begin_run
from plateviz.runs.run import Run
from plateviz.runs.run_directory import RunDirectory
from plateviz.tables.explore import EXPLORABLE, explorable_measurements
from solver.data.settings import FitSettings
from solver.data.survey_schema import HISTORY
from solver.errors import InputError

ORBITS = (0, 1, 2)


def result_of_orbit(result, orbit):
    tables = {
        name: getattr(result, name).assign(orbit_id=orbit) for name in ("residuals", "exposures")
    }
    # The third orbit has measured only some of the sources.
    if orbit == 2:
        tables["residuals"] = tables["residuals"].iloc[: len(result.residuals) // 5]
    return replace(result, **tables)


def history_of(result, orbit):
    sources = result.sources.iloc[: 40 * (orbit + 1)]
    frame = pd.DataFrame({name: 0.1 for name in HISTORY.names}, index=sources.index)
    shared = [name for name in HISTORY.names if name in sources]
    frame[shared] = sources[shared]
    return frame.assign(orbit_id=orbit, epoch=61_800.5 + orbit, true_offset_ra=np.nan)


@pytest.fixture(scope="module")
def results(make_fit_result):
    return {orbit: result_of_orbit(make_fit_result(1)[0], orbit) for orbit in ORBITS}


@pytest.fixture(scope="module")
def made(results, fitted_survey):
    """A run with three orbits that nobody has gathered."""
    begin_run(fitted_survey, "default", FitSettings())
    run = RunDirectory(fitted_survey, "default")
    for orbit, result in results.items():
        run.keep(orbit, result, {"history": history_of(result, orbit)})
    return run


@pytest.fixture
def run(made):
    return Run(made)


@pytest.fixture
def copied(made, tmp_path):
    """A private copy of the run, which may be damaged."""
    survey = shutil.copytree(made.survey, tmp_path / "survey")
    return RunDirectory(survey, "default")


def residuals(run, kept=None):
    return explorable_of_run(run, "measurements", kept or ColumnCache())


def test_residuals_of_all_orbits_have_the_columns_of_an_orbit(run, results):
    table = residuals(run)
    orbits = [explorable_measurements(result) for result in results.values()]
    assert table.size == sum(one.size for one in orbits)
    assert set(orbits[0].columns) < set(table.columns)
    for name in orbits[0].columns:
        if name == "n_obs":  # a synthetic source has more than its rows
            continue
        expected = np.concatenate([one.numbers(name) for one in orbits])
        np.testing.assert_allclose(table.numbers(name), expected, rtol=2e-7, atol=1e-12)
        assert table.numbers(name).dtype == np.float32


def test_residuals_have_orbit_time_and_number_of_measurements(run, results):
    table = residuals(run)
    frames = [result.residuals for result in results.values()]
    rows = pd.concat(frames, ignore_index=True)
    np.testing.assert_array_equal(table.numbers("orbit_id"), rows["orbit_id"])
    n_obs = rows.groupby(["orbit_id", "source_id"])["nx"].transform("size")
    np.testing.assert_array_equal(table.numbers("n_obs"), n_obs)
    times = [r.exposures["obstime"].to_numpy()[r.exposure_index] for r in results.values()]
    np.testing.assert_array_equal(table.numbers("obstime"), np.concatenate(times))
    last = np.array([0, table.size - 1])
    assert table.words["orbit"](last).tolist() == ["0", "2"]


@pytest.mark.parametrize("rows", ["measurements", "sources per orbit"])
def test_rows_have_their_sources_and_classes(rows, run, results):
    table = explorable_of_run(run, rows, ColumnCache())
    ids, codes, classes = table.sources()
    name = "residuals" if rows == "measurements" else "sources"
    expected = {
        "residuals": [r.residuals["source_id"] for r in results.values()],
        "sources": [history_of(r, orbit)["source_id"] for orbit, r in results.items()],
    }[name]
    np.testing.assert_array_equal(ids[codes], np.concatenate(expected))
    assert np.all(np.diff(ids) > 0)
    flags = results[0].sources.set_index("source_id")["is_reference"]
    known = flags.index.intersection(history_of(results[2], 2)["source_id"]).intersection(ids)
    is_reference = pd.Series(classes == "reference", index=ids)
    np.testing.assert_array_equal(is_reference[known], flags[known])


def test_only_columns_that_are_asked_for_are_read_and_once(run, monkeypatch):
    read = []
    original = explorable.FileRows._column
    monkeypatch.setattr(
        explorable.FileRows, "_column", lambda self, name: read.append(name) or original(self, name)
    )
    kept = ColumnCache()
    for _ in range(2):
        table = residuals(run, kept)
        table.numbers("nx")
        table.numbers("phase_x")
    assert read == ["nx", "phase_x"]
    assert kept.size == 2 * 4 * table.size


def test_sources_per_orbit_are_the_same_before_and_after_gathering(copied):
    before = explorable_of_run(Run(copied), "sources per orbit", ColumnCache())
    gather_history(copied)
    after = explorable_of_run(Run(copied), "sources per orbit", ColumnCache())
    assert before.size == after.size
    for name in ("epoch", "offset_ra", "chi2_per_dof", "is_reference"):
        found = [np.sort(table.numbers(name)) for table in (before, after)]
        np.testing.assert_array_equal(*found)
    assert np.isnan(before.numbers("deviation_ra_mas")).all()
    pulls = before.numbers("pull_dec") * before.numbers("sigma_dec_marginal")
    np.testing.assert_allclose(pulls, before.numbers("offset_dec") - 0.1, atol=1e-12)


def test_orbits_and_motions_are_tables_of_the_run(run):
    orbits = explorable_of_run(run, "orbits", ColumnCache())
    assert orbits.words["orbit_id"](np.array([0, 2])).tolist() == ["0", "2"]
    assert not orbits.has_sources
    motions = explorable_of_run(run, "motions", ColumnCache())
    assert motions.size == 0
    for table, name in ((orbits, "orbits"), (motions, "motions")):
        assert list(table.columns) == [*COLUMNS_OF_RUN[name]]


def test_exposures_of_a_run_are_those_of_its_orbits(run, results):
    table = explorable_of_run(run, "exposures", ColumnCache())
    assert list(table.columns) == [*COLUMNS_OF_RUN["exposures"]]
    alone = [EXPLORABLE["exposures"](result) for result in results.values()]
    assert table.size == sum(one.size for one in alone)
    for name in alone[0].columns:
        expected = np.concatenate([one.numbers(name) for one in alone])
        np.testing.assert_allclose(table.numbers(name), expected, err_msg=name)
    assert {"focal_length", "position_angle"} <= set(table.columns)
    # What the orbits do not fit has no values.
    assert np.isnan(table.numbers("focal_anisotropy_offset")).all()
    last = np.array([table.size - 1])
    assert table.words["orbit_id"](last).tolist() == ["2"]
    assert table.words["exposure"](last).tolist() == [alone[2].words["exposure"](-1)]


def test_of_too_many_residuals_those_of_every_nth_orbit_are_shown(run, results, monkeypatch):
    monkeypatch.setattr(explorable, "MOST_ROWS", 2 * len(results[0].residuals))
    table = residuals(run)
    assert set(table.numbers("orbit_id")) == {0, 2}
    assert "one orbit in 2" in table.note


def test_orbit_that_is_added_is_there(copied, results):
    kept = ColumnCache()
    shutil.move(copied.orbit_directory(2), copied.directory / "later")
    before = residuals(Run(copied), kept)
    before.numbers("nx")
    shutil.move(copied.directory / "later", copied.orbit_directory(2))
    after = residuals(Run(copied), kept)
    assert len(after.numbers("nx")) == before.size + len(results[2].residuals)


def test_run_without_an_orbit_has_no_rows(copied):
    for orbit in ORBITS:
        shutil.rmtree(copied.orbit_directory(orbit))
    for rows in ("measurements", "sources per orbit"):
        table = explorable_of_run(Run(copied), rows, ColumnCache())
        assert (table.size, len(table.numbers("chi2" if "orbit" in rows else "nx"))) == (0, 0)


def test_damaged_column_is_refused_by_name_and_the_others_are_read(copied):
    path = copied.orbit_directory(1) / "residuals.parquet"
    content = bytearray(path.read_bytes())
    chunk = parquet.read_metadata(path).row_group(0)
    place = {chunk.column(k).path_in_schema: chunk.column(k) for k in range(chunk.num_columns)}
    start = place["nx"].data_page_offset + place["nx"].total_compressed_size // 2
    content[start] ^= 8
    path.write_bytes(content)
    table = residuals(Run(copied))
    with pytest.raises(InputError, match=r"orbit=0001/residuals\.parquet"):
        table.numbers("nx")
    assert np.isfinite(table.numbers("ny")).all()


def test_run_that_is_removed_meanwhile_is_refused_by_name(copied):
    table = residuals(Run(copied))
    known = table.numbers("nx")
    shutil.rmtree(copied.directory)
    with pytest.raises(InputError, match=r"residuals\.parquet"):
        table.numbers("ny")
    assert table.numbers("nx") is known
    for rows in COLUMNS_OF_RUN:
        with pytest.raises(InputError, match="the run default is not on the disk any more"):
            explorable_of_run(Run(copied), rows, ColumnCache())


def test_columns_of_one_name_are_refused(copied):
    """One bit makes "residual_y" of "residual_x", and no checksum of a page tells."""
    path = copied.orbit_directory(0) / "residuals.parquet"
    path.write_bytes(path.read_bytes().replace(b"residual_x", b"residual_y"))
    with pytest.raises(InputError, match="once each"):
        residuals(Run(copied)).numbers("residual_y")
