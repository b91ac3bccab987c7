import re

import numpy as np
import pytest

from solver.data.parameters import BY_NAME
from solver.data.prior_text import format_shift, format_width, parse_shift, parse_width
from solver.errors import InputError


@pytest.mark.parametrize(
    ("name", "text", "width"),
    [
        ("pointing_ra", "0.5 deg", 1800.0),
        ("pointing_ra", "2arcmin", 120.0),
        ("detector_x", "3", 3.0),
        ("detector_x", "0.1 mm", 100.0),
        ("distortion_x", "500nm", 0.5),
        ("distortion_x", "2 µm", 2.0),
        ("pitch_x", "1e-3", 1e-3),
        ("sources", "2.5", 2.5),
        ("detector_x", "1e-3 cm", 10.0),
        ("pointing_ra", "1e-6 rad", 0.20626480624709636),
        ("focal_length", "flat", np.inf),
        ("position_angle", "inf", np.inf),
    ],
)
def test_width_is_parsed(name, text, width):
    assert parse_width(name, text) == pytest.approx(width)


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("pointing_ra", "5 um", "arcsec"),
        ("detector_x", "5 mas", "such as um"),
        ("pitch_x", "1 um", "without unit"),
        ("detector_x", "wide", "'wide'"),
        ("detector_x", "-3 um", "positive"),
        ("detector_x", "0", "positive"),
        ("detector_x", "", "''"),
        ("sources", "flat", "sources"),
        ("nothing", "1", "'nothing'"),
        ("sources", "1e-300", "from 1e-09 to 1e+09 or 'flat' for sources, found 1e-300"),
        ("detector_x", "1e300 um", "from 1e-09 to 1e+09 um or 'flat' for detector_x"),
        ("detector_x", "1e400 um", "expected a finite width or 'flat', found '1e400 um'"),
    ],
)
def test_invalid_width_is_refused(name, text, complaint):
    with pytest.raises(InputError, match=re.escape(complaint)):
        parse_width(name, text)


@pytest.mark.parametrize("name", [n for n in BY_NAME if n != "sources"])
@pytest.mark.parametrize("width", [0.25, 3600.0, np.inf], ids=str)
def test_formatted_width_is_parsed_back(name, width):
    assert parse_width(name, format_width(name, width)) == width


@pytest.mark.parametrize(
    ("text", "name", "shift"),
    [
        ("focal_length=100um", "focal_length", 100.0),
        ("focal_length[0/3] = -0.1 mm", "focal_length[0/3]", -100.0),
        ("detector_x[2]=+5", "detector_x[2]", 5.0),
        ("distortion_y[3/0]=2.5e3nm", "distortion_y[3/0]", 2.5),
        ("pointing_ra=1arcmin", "pointing_ra", 60.0),
        ("pitch_x=0.01um", "pitch_x", 0.01),
        ("sources[ra]=100uas", "sources[ra]", 0.1),
    ],
)
def test_shift_is_parsed_and_formatted(text, name, shift):
    assert parse_shift(text) == (name, pytest.approx(shift))
    assert parse_shift(format_shift(name, shift)) == (name, pytest.approx(shift))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("focal_length", "expected GROUP=SHIFT"),
        ("focal_length=", "expected GROUP=SHIFT"),
        ("focal_length=flat", "expected GROUP=SHIFT"),
        ("detector_x[2=5", r"expected GROUP or GROUP\[ELEMENT\]"),
        ("detector_z=5", "'detector_z'"),
        ("detector_x=5mas", "such as um"),
        ("sources=1mas", r"sources\[ra\] or sources\[dec\]"),
        ("sources[4057]=1mas", "whole catalogue"),
        ("detector_x=1e999", "finite"),
    ],
)
def test_invalid_shift_is_refused(text, complaint):
    with pytest.raises(InputError, match=complaint):
        parse_shift(text)
