"""Fitted orbits that pages share, and those that are read ahead."""

import threading

import pytest

from plateviz.runs.fitted_orbit import write_fitted_orbit
from plateviz.runs.orbit_cache import OrbitCache
from solver.errors import InputError

LONG = 30


class Orbit:
    """Stands for a fitted orbit."""

    exposure_index = None


class Reader:
    """Reads an orbit as an object of its own, and notes which."""

    def __init__(self):
        self.read = []
        self.is_read = threading.Event()

    def __call__(self, directory):
        self.read.append(directory.name)
        self.is_read.set()
        return Orbit()


@pytest.fixture
def reader():
    return Reader()


@pytest.fixture
def cache(reader):
    made = OrbitCache(reader, pause=0.0)
    yield made
    made.close()


def orbit(folder, name="orbit=0000"):
    (folder / name).mkdir()
    (folder / name / "result.json").write_text("{}")
    return folder / name


def test_pages_share_an_orbit_until_its_files_change(tmp_path, cache, reader):
    one = orbit(tmp_path)
    first = cache.read(one)
    assert cache.read(one) is first
    (one / "result.json").write_text("{ }")
    assert cache.read(one) is not first
    assert reader.read == [one.name] * 2


def test_orbit_that_was_damaged_or_removed_since_is_not_shown(tmp_path, fit_result):
    one = tmp_path / "orbit=0000"
    write_fitted_orbit(one, fit_result)
    cache = OrbitCache()
    shown = cache.read(one)
    assert shown.orbit_id == fit_result.orbit_id
    path = one / "sources.parquet"
    content = path.read_bytes()
    path.write_bytes(content[:-9] + bytes([content[-9] ^ 1]) + content[-8:])
    with pytest.raises(InputError, match=r"sources\.parquet: expected the file that was written"):
        cache.read(one)
    one.rename(tmp_path / "removed")
    with pytest.raises(InputError, match="expected a complete fitted orbit"):
        cache.read(one)
    cache.close()


def test_failure_is_not_kept(tmp_path):
    one, failures = orbit(tmp_path), [InputError("a damaged file")]

    def read(directory):
        if failures:
            raise failures.pop()
        return Orbit()

    cache = OrbitCache(read)
    with pytest.raises(InputError, match="a damaged file"):
        cache.read(one)
    assert cache.read(one) is cache.read(one)
    cache.close()


def test_few_orbits_are_kept_beside_those_on_the_screen(tmp_path, cache, reader):
    first = orbit(tmp_path, "orbit=0000")
    shown = cache.read(first)
    others = [orbit(tmp_path, f"orbit={number:04d}") for number in range(1, 12)]
    for other in others:
        cache.read(other)
    assert cache.read(first) is shown
    cache.read(others[-1])
    assert len(reader.read) == 12
    cache.read(others[0])
    assert len(reader.read) == 13


def test_expected_orbit_is_read_ahead_once(tmp_path, cache, reader):
    one = orbit(tmp_path)
    cache.expect(one)
    assert reader.is_read.wait(LONG)
    cache.read(one)
    assert reader.read == [one.name]


def test_only_orbits_that_were_expected_last_are_read_ahead(tmp_path, reader):
    cache = OrbitCache(reader, pause=0.05)
    orbits = [orbit(tmp_path, f"orbit={number:04d}") for number in range(8)]
    for one in orbits:
        cache.expect(one)
    cache._reader.shutdown(wait=True)
    # The first may have been begun before the others came.
    assert set(reader.read) - {"orbit=0000"} == {one.name for one in orbits[4:]}


def test_closed_cache_reads_nothing_ahead(tmp_path, reader):
    cache = OrbitCache(reader, pause=LONG)
    cache.expect(orbit(tmp_path))
    cache.close()
    cache.expect(orbit(tmp_path, "orbit=0001"))
    cache._reader.shutdown(wait=True)
    assert reader.read == []
