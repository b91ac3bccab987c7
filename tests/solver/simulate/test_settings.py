"""Settings of a simulated survey: the paper's numbers, invalid values and round trips."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from solver.errors import InputError
from solver.simulate.seasons import Season
from solver.simulate.settings import SurveySettings
from solver.simulate.streams import Stream


def test_defaults_agree_with_the_paper() -> None:
    settings = SurveySettings()
    assert (settings.n_stars, settings.n_reference, settings.n_artificial) == (132651, 10888, 1000)
    assert settings.orbits == 100
    assert settings.n_fields * settings.exposures_per_field == 96
    assert settings.season_days == 90 + 92 + 89 + 92 + 89 + 92
    assert settings.orbit_days * 86400.0 == pytest.approx(96 * 20 + 3 * 90)


def test_dict_round_trip_keeps_every_setting() -> None:
    settings = replace(
        SurveySettings(),
        seed=7,
        seasons=(Season("2031-01-01", "2031-02-01", 12.0),),
        distortion_um=((2, 0, 1.0, -1.0),),
        pair_axes=("l",),
    )
    assert SurveySettings.from_dict(settings.to_dict()) == settings


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"orbits": 0}, "orbits of at least 1, found 0"),
        ({"orbits": 2.5}, "orbits to be an integer of at least 0, found 2.5"),
        ({"orbits": True}, "orbits to be an integer of at least 0, found True"),
        ({"orbits": 10**6}, "expected at most .* orbits"),
        ({"seed": -1}, "seed to be an integer of at least 0, found -1"),
        ({"n_stars": 10, "n_reference": 11}, "n_reference of at most n_stars, 10, found 11"),
        ({"measurement_mas": 0.0}, "positive measurement_mas"),
        ({"measurement_mas": float("nan")}, "measurement_mas to be a number of at least 0"),
        ({"pointing_walk_arcsec": -1.0}, "pointing_walk_arcsec to be a number of at least 0"),
        ({"target_deg": (0.0,)}, "two numbers in target_deg"),
        ({"field_l_deg": (1.0, -1.0)}, "field_l_deg from low to high"),
        ({"pair_axes": ("x",)}, "pair_axes out of 'l' and 'b', found \\['x'\\]"),
        ({"pair_axes": ()}, "at least one pair"),
        ({"seasons": ()}, "at least one season"),
        ({"seasons": SurveySettings().seasons[::-1]}, "each after the one before"),
        ({"distortion_um": ((1, 0, 1.0, 1.0),)}, "sum from 2 to 9"),
        ({"distortion_um": ((9, 1, 1.0, 1.0),)}, "sum from 2 to 9"),
        ({"distortion_um": ((2, 0, 1.0),)}, "rows k, l, A_kl, B_kl"),
        ({"distortion_um": ((2, 0, 1.0, 0.0), (2, 0, 2.0, 0.0))}, "each k, l once"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_invalid_settings_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(SurveySettings(), **changes)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"orbit": 3}, "expected settings of a survey, found orbit"),
        ({"seasons": 3}, "expected seasons to be a sequence, found 3"),
        ({"pair_axes": [{"l": 1}]}, "pair_axes out of 'l' and 'b'"),
        ({"distortion_um": [3]}, "rows k, l, A_kl, B_kl in distortion_um, found 3"),
        ({"seasons": [{"start": "2030-01-01"}]}, "in each season"),
        (
            {"seasons": [{"start": "soon", "end": "2030-01-01", "position_angle_deg": 0.0}]},
            "a date such as",
        ),
        (
            {"seasons": [{"start": "2030-02-01", "end": "2030-01-01", "position_angle_deg": 0.0}]},
            "a season to end after 2030-02-01",
        ),
        (
            {"seasons": [{"start": "2030-01-01", "end": "2030-02-01", "position_angle_deg": "0"}]},
            "position_angle_deg in deg",
        ),
    ],
    ids=["unknown", "seasons", "axes", "distortion", "attributes", "date", "order", "angle"],
)
def test_invalid_dicts_are_refused(values: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SurveySettings.from_dict(values)


@pytest.mark.parametrize(
    ("stars", "counts"),
    [(132651, (10888, 1000)), (66326, (5444, 500)), (5000, (1250, 38)), (300, (300, 10))],
)
def test_scaled_keeps_enough_reference_stars(stars: int, counts: tuple[int, int]) -> None:
    settings = SurveySettings().scaled(stars)
    assert settings.n_stars == stars
    assert (settings.n_reference, settings.n_artificial) == counts


def test_scaled_refuses_zero_stars() -> None:
    with pytest.raises(InputError, match="at least 1 star"):
        SurveySettings().scaled(0)


def test_streams_are_reproducible_and_differ_by_stream_key_and_seed() -> None:
    settings = SurveySettings()
    first = settings.rng(Stream.ATTITUDE, 3).random(4)
    np.testing.assert_array_equal(first, settings.rng(Stream.ATTITUDE, 3).random(4))
    for other in (
        settings.rng(Stream.ATTITUDE, 4),
        settings.rng(Stream.MEASUREMENTS, 3),
        replace(settings, seed=1).rng(Stream.ATTITUDE, 3),
    ):
        assert not np.isin(first, other.random(4)).any()


def test_planning_and_reading_need_no_jax() -> None:
    modules = "settings, solver.simulate.schedule, solver.simulate.catalogue, solver.simulate.sky"
    code = f"import sys, solver.simulate.{modules}, solver.io.survey; print('jax' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
