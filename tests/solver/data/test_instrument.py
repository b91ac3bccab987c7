from dataclasses import replace

import numpy as np
import pytest

from solver.data.instrument import (
    MINI_MOCK,
    parse_instrument,
    read_instrument,
    write_instrument,
)
from solver.errors import InputError


@pytest.fixture
def read_text(tmp_path):
    """Return the function that reads an instrument from a text."""

    def read(text):
        path = tmp_path / "instrument.toml"
        path.write_text(text, encoding="utf-8")
        return read_instrument(path)

    return read


def changed(old, new):
    text = write_instrument(MINI_MOCK)
    assert old in text
    return text.replace(old, new, 1)


def test_mini_mock_agrees_with_the_paper():
    assert MINI_MOCK.focal_length_um == 4.86e6
    assert MINI_MOCK.distortion_scale_um == 21_000.0
    assert [(d.n_x, d.n_y, d.pitch_x_um) for d in MINI_MOCK.detectors] == [(1920, 1920, 10.0)] * 4


def test_mini_mock_has_gaps_of_three_millimetres():
    corners = np.concatenate([d.corners_um() for d in MINI_MOCK.detectors])
    np.testing.assert_allclose(np.unique(np.abs(corners).round(6)), [1500.0, 20_700.0])


def test_instrument_round_trips(read_text):
    assert read_text(write_instrument(MINI_MOCK)) == MINI_MOCK


@pytest.mark.parametrize(
    "name",
    ['the "great" one', "back\\slash", "two\nlines", "café"],
    ids=["quotes", "backslash", "newline", "accent"],
)
def test_special_characters_in_the_name_round_trip(read_text, name):
    instrument = replace(MINI_MOCK, name=name)
    assert read_text(write_instrument(instrument)) == instrument


def test_detector_ids_may_be_arbitrary(read_text):
    detectors = tuple(replace(d, detector_id=10 * d.detector_id + 3) for d in MINI_MOCK.detectors)
    instrument = read_text(write_instrument(replace(MINI_MOCK, detectors=detectors)))
    np.testing.assert_array_equal(instrument.index_of(np.array([33, 3, 3, 13])), [3, 0, 0, 1])
    with pytest.raises(InputError, match=r"\(\[3, 13, 23, 33\]\), found \[4\]"):
        instrument.index_of(np.array([33, 4]))


def test_integer_lengths_are_accepted(read_text):
    assert (
        read_text(changed("focal_length_um = 4860000.0", "focal_length_um = 4860000")) == MINI_MOCK
    )


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("focal_length_um = 4860000.0", "", "missing: focal_length_um"),
        ("focal_length_um", "focal_length", "unknown: focal_length"),
        ("focal_length_um = 4860000.0", "focal_length_um = -1.0", "focal_length_um.*positive"),
        ("focal_length_um = 4860000.0", 'focal_length_um = "4 m"', "'4 m'"),
        ("focal_length_um = 4860000.0", "focal_length_um = true", "True"),
        ("focal_length_um = 4860000.0", "focal_length_um = inf", "inf"),
        ("focal_length_um = 4860000.0", "focal_length_um = nan", "nan"),
        ("distortion_scale_um = 21000.0", "distortion_scale_um = 0", "distortion_scale_um"),
        ("x_um = -11100.0", "", "missing: x_um"),
        ("x_um = -11100.0", 'x_um = "left"', "left"),
        ("x_um = -11100.0", "x_um = nan", "nan"),
        ("rotation_deg = 0.0", "angle = 0.0", "unknown: angle"),
        ("pitch_x_um = 10.0", "pitch_x_um = 0.0", "pitch_x_um of detector number 0"),
        ("n_x = 1920", "n_x = 0", "n_x of detector number 0"),
        ("n_x = 1920", "n_x = 1920.5", "1920.5"),
        ("id = 1\n", "id = 0\n", "each detector id once"),
        ("id = 1\n", "id = 1.5\n", "1.5"),
        ("name = ", "name = = ", "line 1"),
        ('name = "JASMINE mini-mock"', "name = 3", "name to be a text, found 3"),
    ],
)
def test_invalid_value_is_refused_with_the_file_name(read_text, old, new, complaint):
    with pytest.raises(InputError, match=rf"instrument\.toml: expected.*(?s:.)*{complaint}"):
        read_text(changed(old, new))


@pytest.mark.parametrize(
    "detectors", ["", "detector = 3", "detector = []", "detector = [1, 2]"], ids=repr
)
def test_file_without_detectors_is_refused(read_text, detectors):
    head = write_instrument(MINI_MOCK).split("[[detector]]")[0]
    with pytest.raises(InputError, match=r"instrument\.toml: expected.*detector"):
        read_text(head + detectors)


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="absent.toml: expected an instrument"):
        read_instrument(tmp_path / "absent.toml")


def test_binary_file_is_refused(tmp_path):
    path = tmp_path / "image.toml"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="image.toml"):
        read_instrument(path)


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 5_000 + "]" * 5_000,
        "a = " + "9" * 5_000,
        "a = 0x" + "f" * 5_000,
        "a = [{ b = " + "9" * 20 + " }]",
        "a = " + "{ b = " * 3_000 + "1" + " }" * 3_000,
    ],
    ids=["nested", "digits", "hexadecimal", "64-bits", "tables"],
)
def test_hostile_toml_is_refused_in_words(tmp_path, text):
    (tmp_path / "i.toml").write_text(text)
    with pytest.raises(InputError, match=r"i\.toml: expected"):
        read_instrument(tmp_path / "i.toml")


def test_integer_beyond_every_float_is_refused_in_words(tmp_path):
    text = write_instrument(MINI_MOCK).replace("4860000.0", "9" * 400)
    with pytest.raises(InputError, match="an integer that does not fit into 64 bits"):
        parse_instrument(text, tmp_path / "i.toml")
