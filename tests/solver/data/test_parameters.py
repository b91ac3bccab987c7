import numpy as np
import pytest

from solver.data.parameters import (
    BY_NAME,
    CALIBRATION_GROUPS,
    OPTIONAL_GROUPS,
    PARAMETERS,
    Group,
    groups_on,
)
from solver.data.prior_text import format_shift, format_width, parse_shift, parse_width
from solver.data.settings import SETTINGS, FitSettings
from solver.units import factor_between


def test_names_are_unique():
    assert len(BY_NAME) == len(PARAMETERS)


def test_every_group_but_the_sources_is_calibration():
    named = {g.name for g in (*CALIBRATION_GROUPS, *OPTIONAL_GROUPS)}
    assert {g.name for g in PARAMETERS} - named == {"sources"}


def test_optional_groups_are_those_of_a_setting():
    assert all(g.setting in SETTINGS and SETTINGS[g.setting].is_cause for g in OPTIONAL_GROUPS)
    assert not FitSettings().optional_groups
    assert {g.name for g in FitSettings(drift=2).optional_groups} == {"drift_x", "drift_y"}


def test_every_group_is_on_one_axis():
    axes = [groups_on(axis) for axis in ("src", "exp", "coef", "det")]
    optional = {g.name for g in OPTIONAL_GROUPS}
    assert sorted(g.name for groups in axes for g in groups) == sorted(set(BY_NAME) - optional)


@pytest.mark.parametrize(
    ("name", "width"),
    [
        ("pointing_ra", 3600.0),
        ("pointing_dec", 3600.0),
        ("distortion_x", 1.0),
        ("distortion_y", 1.0),
        ("detector_x", 100.0),
        ("detector_y", 100.0),
        ("detector_rotation", 360.0),
        ("pitch_x", 0.01),
        ("pitch_y", 0.01),
    ],
)
def test_default_widths_are_those_of_the_papers_table(name, width):
    assert BY_NAME[name].width == width


def test_position_angle_is_flat_and_focal_length_gamma():
    assert np.isinf(BY_NAME["position_angle"].width)
    assert BY_NAME["position_angle"].family == "uniform"
    assert BY_NAME["focal_length"].family == "gamma"


def test_focal_length_width_is_a_hundred_um_per_degree():
    assert BY_NAME["focal_length"].width == pytest.approx(100.0 * np.degrees(1.0))


@pytest.mark.parametrize("group", PARAMETERS, ids=lambda g: g.name)
def test_value_unit_is_converted(group):
    factors = {("mas", "deg"): 3.6e6, ("arcsec", "deg"): 3600.0}
    assert group.per_value_unit == factors.get((group.unit, group.value_unit), 1.0)


@pytest.mark.parametrize("group", PARAMETERS, ids=lambda g: g.name)
def test_width_that_is_a_fraction_or_a_factor_has_no_unit(group):
    assert (group.width_unit == "") == (group.relative or group.name == "sources")


def test_group_may_have_any_unit_of_astropy():
    group = Group("squeeze", "squeeze", "ε", "exp", "ppm", "%", "normal", 50.0)
    assert group.per_value_unit == 1e4
    assert factor_between("mas", "rad") == pytest.approx(4.84813681109536e-09)
    with pytest.raises(ValueError, match="convertible"):
        factor_between("um", "arcsec")


def test_width_in_ppm_is_formatted_and_parsed(monkeypatch):
    group = Group("squeeze", "squeeze", "ε", "exp", "ppm", "ppm", "normal", 50.0)
    monkeypatch.setitem(BY_NAME, "squeeze", group)
    assert format_width("squeeze", 50.0) == "50 ppm"
    assert parse_width("squeeze", "50 ppm") == 50.0
    assert parse_width("squeeze", "0.01 %") == 100.0
    assert parse_shift(format_shift("squeeze[0/3]", -3.0)) == ("squeeze[0/3]", -3.0)
