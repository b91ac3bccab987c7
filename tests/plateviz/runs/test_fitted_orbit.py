"""Fitted orbits on disk: complete or absent, and unchanged when read back."""

import errno
import json
from dataclasses import replace

import pandas as pd
import pytest

from plateviz.runs.fitted_orbit import FORMAT, is_complete, read_fitted_orbit, write_fitted_orbit
from solver.data.schema import RESULT_TABLES, SOURCES
from solver.errors import DiskError, InputError


def test_fitted_orbit_is_unchanged_when_read_back(fit_result, tmp_path):
    write_fitted_orbit(tmp_path / "run", fit_result)
    back = read_fitted_orbit(tmp_path / "run")
    for table in RESULT_TABLES:
        before, after = getattr(fit_result, table.name), getattr(back, table.name)
        if before is None:
            assert after is None
        else:
            pd.testing.assert_frame_equal(
                before.reset_index(drop=True), after, check_dtype=False, check_exact=True
            )
    assert back.settings == fit_result.settings
    assert back.summary == json.loads(json.dumps(fit_result.summary))
    assert back.sources["source_id"].dtype == "int64"


def test_eigenmodes_have_the_file_of_older_versions(fit_result, tmp_path):
    write_fitted_orbit(tmp_path / "run", fit_result)
    assert len(pd.read_parquet(tmp_path / "run" / "modes.parquet")) == len(fit_result.eigenmodes)


def test_fitted_orbit_of_an_older_version_has_uncorrelated_priors(fit_result, tmp_path):
    older = replace(fit_result, sources=fit_result.sources.drop(columns="prior_corr"))
    write_fitted_orbit(tmp_path / "run", older)
    sources = read_fitted_orbit(tmp_path / "run").sources
    assert list(sources.columns) == SOURCES.names
    assert (sources["prior_corr"] == 0.0).all()


def test_compared_orders_are_stored(compared, tmp_path):
    write_fitted_orbit(tmp_path / "run", compared)
    pd.testing.assert_frame_equal(read_fitted_orbit(tmp_path / "run").orders, compared.orders)


def test_existing_fitted_orbit_is_not_changed(fit_result, make_fit_result, tmp_path):
    write_fitted_orbit(tmp_path / "run", fit_result)
    before = {p.name: p.read_bytes() for p in (tmp_path / "run").iterdir()}
    write_fitted_orbit(tmp_path / "run", make_fit_result(2)[0])
    assert {p.name: p.read_bytes() for p in (tmp_path / "run").iterdir()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_orbit_that_has_lost_its_manifest_is_written_again(fit_result, tmp_path):
    directory = tmp_path / "orbit=0007"
    write_fitted_orbit(directory, fit_result)
    before = read_fitted_orbit(directory)
    (directory / "COMPLETE").unlink()
    write_fitted_orbit(directory, fit_result)
    assert read_fitted_orbit(directory).sources.equals(before.sources)
    assert [path.name for path in tmp_path.iterdir()] == ["orbit=0007"]


def test_interrupted_write_leaves_no_file(fit_result, tmp_path, monkeypatch):
    def stop(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("plateviz.runs.fitted_orbit.flush", stop)
    with pytest.raises(DiskError, match="expected to write the fitted orbit, found a full disk"):
        write_fitted_orbit(tmp_path / "run", fit_result)
    assert list(tmp_path.iterdir()) == []


def test_fitted_orbit_without_its_last_file_is_refused(fit_result, tmp_path):
    write_fitted_orbit(tmp_path / "run", fit_result)
    (tmp_path / "run" / "COMPLETE").unlink()
    assert not is_complete(tmp_path / "run")
    with pytest.raises(InputError, match=r"run: expected a complete fitted orbit, found no COMP"):
        read_fitted_orbit(tmp_path / "run")


def test_fitted_orbit_of_a_newer_version_is_refused(fit_result, tmp_path):
    write_fitted_orbit(tmp_path / "run", fit_result)
    head = json.loads((tmp_path / "run" / "result.json").read_text())
    (tmp_path / "run" / "result.json").write_text(json.dumps({**head, "format": FORMAT + 1}))
    (tmp_path / "run" / "COMPLETE").write_text("")
    with pytest.raises(InputError, match="written by a newer plateviz"):
        read_fitted_orbit(tmp_path / "run")
