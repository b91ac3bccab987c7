"""The instrument of a result: that which it keeps, before any other."""

from dataclasses import replace

import pytest

from solver.data.instrument import MINI_MOCK, instrument_from, write_instrument
from solver.errors import InputError
from solver.io.result import read_result, write_result
from solver.io.result_instrument import instrument_of, require_comparable
from tests.solver.io_samples import small_result

_OTHER = replace(MINI_MOCK, name="another", focal_length_um=2e6)


@pytest.fixture
def camera(tmp_path):
    path = tmp_path / "camera.toml"
    path.write_text(write_instrument(_OTHER), encoding="utf-8")
    return path


def test_instrument_that_a_result_keeps_comes_first(camera):
    result = replace(small_result(), instrument=_OTHER)
    assert instrument_of(result) == _OTHER
    assert instrument_of(result, otherwise=MINI_MOCK) == _OTHER
    assert instrument_of(result, camera) == _OTHER


def test_another_instrument_is_refused(camera):
    result = replace(small_result(), instrument=MINI_MOCK)
    with pytest.raises(InputError, match=r"'JASMINE mini-mock', which it keeps, found 'another'"):
        instrument_of(result, camera)


def test_result_of_an_older_version_takes_what_is_given(tmp_path, camera):
    write_result(replace(small_result(), instrument=None), tmp_path / "old.fits")
    old = read_result(tmp_path / "old.fits")
    assert old.instrument is None
    assert instrument_of(old) == MINI_MOCK
    assert instrument_of(old, otherwise=_OTHER) == _OTHER
    assert instrument_of(old, camera) == _OTHER


@pytest.mark.parametrize("stored", [5, ["a"], {"a": 1}, "x = 1"], ids=str)
def test_what_is_no_instrument_is_refused(stored):
    with pytest.raises(InputError, match=r"^R\.fits: expected the (text of an instrument|keys)"):
        instrument_from(stored, "R.fits")


def test_results_of_two_instruments_are_not_compared():
    one, other, old = (
        replace(small_result(), instrument=camera) for camera in (MINI_MOCK, _OTHER, None)
    )
    with pytest.raises(InputError, match="same instrument to compare, found 'JASMINE"):
        require_comparable(one, other)
    for pair in ((one, one), (one, old), (old, other)):
        require_comparable(*pair)
