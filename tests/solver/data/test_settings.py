import json

import numpy as np
import pytest

from solver.data.engine_settings import WARPFIELD, NutsSettings, SviSettings, svi_settings
from solver.data.parameters import PARAMETERS
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.subset import Subset
from solver.errors import InputError


def test_defaults_are_those_of_the_paper():
    settings = FitSettings()
    assert settings.order == 5
    assert settings.aberration
    assert {g.name: settings.width(g.name) for g in PARAMETERS} == {
        g.name: g.width for g in PARAMETERS
    }


@pytest.mark.parametrize("order", [-1, 10, 5.0, "5", None, True], ids=repr)
def test_invalid_order_is_refused(order):
    with pytest.raises(InputError, match="distortion order from 0 to 9"):
        FitSettings(order=order)


def test_unknown_engine_is_refused():
    with pytest.raises(InputError, match="gauss-newton.*'magic'"):
        FitSettings(engine="magic")


@pytest.mark.parametrize("width", [0.0, -1.0, float("nan")], ids=str)
def test_width_that_is_not_positive_is_refused(width):
    with pytest.raises(InputError, match="positive prior width for detector_x"):
        FitSettings(prior_widths={"detector_x": width})


def test_unknown_group_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="pointing_ra.*'detector_z'"):
        FitSettings(prior_widths={"detector_z": 1.0})


def test_flat_prior_is_allowed_on_the_calibration_and_not_on_the_sources():
    assert np.isinf(FitSettings(prior_widths={"pitch_x": np.inf}).width("pitch_x"))
    with pytest.raises(InputError, match="finite factor.*sources"):
        FitSettings(prior_widths={"sources": np.inf})


def test_what_is_no_number_is_refused_where_one_is_needed():
    for period in ("97 min", True, None):
        with pytest.raises(InputError, match="positive breathing_period, found"):
            FitSettings(breathing_period=period)
    assert FitSettings(breathing_period=np.float32(90.0)).breathing_period == 90.0


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), float("inf")], ids=str)
def test_tolerance_that_is_not_positive_and_finite_is_refused(tolerance):
    with pytest.raises(InputError, match="tolerance"):
        FitSettings(tolerance=tolerance)


@pytest.mark.parametrize("limit", [0, -1, 2.5], ids=str)
def test_invalid_maximum_of_iterations_is_refused(limit):
    with pytest.raises(InputError, match="max_iterations"):
        FitSettings(max_iterations=limit)


def test_settings_are_restored_from_json():
    settings = FitSettings(order=3, aberration=False, prior_widths={"pitch_x": 0.1}, tolerance=0.01)
    assert FitSettings.from_dict(json.loads(json.dumps(settings.to_dict()))) == settings


def test_copy_with_changes_is_checked():
    settings = FitSettings(order=3)
    assert settings.with_(order=4) == FitSettings(order=4)
    with pytest.raises(InputError, match="order"):
        settings.with_(order=99)


def test_prior_widths_are_copied():
    widths = {"pitch_x": 0.1}
    settings = FitSettings(prior_widths=widths)
    widths["pitch_x"] = -5.0
    assert settings.width("pitch_x") == 0.1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SviSettings(steps=0), "svi steps to be 1 or more, found 0"),
        (lambda: SviSettings(patience=2.5), "svi patience to be 1 or more, found 2.5"),
        (lambda: SviSettings(max_steps=100), r"not to be below steps \(1500\), found 100"),
        (lambda: SviSettings(last_rate=1e5), "positive svi learning rates that fall"),
        (lambda: SviSettings(last_rate=0.0), "positive svi learning rates that fall"),
        (lambda: SviSettings(tolerance=0.0), "positive svi tolerance, found 0.0"),
        (lambda: SviSettings(seed=-1), "seed from 0 to 4294967295, found -1"),
        (lambda: NutsSettings(chains=0), "nuts chains to be 1 or more, found 0"),
        (lambda: NutsSettings(samples=3), "nuts samples to be 4 or more, found 3"),
        (lambda: FitSettings(thin=0), "thin to be 1 or more, found 0"),
        (lambda: svi_settings("pyro", None, 0), "expected warpfield, found 'pyro'"),
    ],
)
def test_invalid_engine_setting_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_engine_settings_are_restored_from_json():
    settings = FitSettings(
        engine="svi", thin=3, svi=svi_settings("warpfield", 500, 7), nuts=NutsSettings(samples=9)
    )
    plain = json.loads(json.dumps(settings.to_dict()))
    assert FitSettings.from_dict(plain) == settings


def test_warpfield_has_the_learning_rates_of_the_paper():
    chosen = svi_settings("warpfield", 500, 7)
    assert (chosen.first_rate, chosen.last_rate, chosen.patience) == (1e-3, 1e-10, 10_000)
    assert not chosen.conditioned
    assert (chosen.steps, chosen.max_steps, chosen.seed) == (500, 1000, 7)
    assert svi_settings("warpfield", None, 0) == WARPFIELD
    assert svi_settings(None, None, 4) == SviSettings(seed=4)


def test_step_tolerance_is_that_of_the_engine():
    assert FitSettings().step_tolerance == FitSettings().tolerance
    assert FitSettings(engine="svi").step_tolerance == SviSettings().tolerance


def test_comparison_of_orders_is_off_in_files_without_it():
    settings = FitSettings(compare_orders=True)
    plain = json.loads(json.dumps(settings.to_dict()))
    assert FitSettings.from_dict(plain) == settings
    del plain["compare_orders"]
    assert FitSettings.from_dict(plain) == FitSettings()


def test_every_setting_has_what_its_interfaces_need():
    for name, one in SETTINGS.items():
        assert one.label, name
        assert one.help.endswith("."), name
        one.check(name, DEFAULTS[name])
        assert one.from_plain(one.to_plain(DEFAULTS[name])) == DEFAULTS[name]
    cards = [one.card for one in SETTINGS.values() if one.card]
    assert len(set(cards)) == len(cards)
    assert all(len(card) <= 8 for card in cards)


def test_unknown_setting_is_refused():
    with pytest.raises(TypeError, match="flavour"):
        FitSettings.from_dict({"order": 3, "flavour": 1})


def test_identity_ignores_settings_that_do_not_affect_the_solution():
    asked = FitSettings(order=3, compare_orders=True)
    assert asked.identity() == FitSettings(order=3).identity()
    assert asked.identity() != FitSettings(order=4).identity()


@pytest.mark.parametrize(
    ("changes", "holds"),
    [
        ({"order": 3, "prior_shifts": {"detector_x": 1.0}}, True),
        ({"prior_widths": {"pitch_x": 0.1}}, True),
        ({"aberration": False}, False),
        ({"robust": True}, False),
        ({"engine": "nuts"}, False),
    ],
)
def test_what_if_is_valid_unless_the_model_the_outliers_or_the_engine_change(changes, holds):
    assert FitSettings().what_if_holds(FitSettings(**changes)) == holds


@pytest.mark.parametrize(
    ("fit", "asked", "serves"),
    [
        ({}, {"order": 3}, True),
        ({}, {"order": 6}, False),
        ({}, {"exclusions": Subset(detectors=frozenset({1}))}, True),
        ({"exclusions": Subset(detectors=frozenset({1}))}, {}, False),
        ({"thin": 10}, {}, False),
        ({"thin": 10}, {"thin": 10}, True),
        ({}, {"thin": 10}, True),
    ],
)
def test_what_ifs_start_from_a_fit_of_all_their_measurements(fit, asked, serves):
    assert FitSettings(**fit).serves(FitSettings(**asked)) == serves


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, "order 5"),
        ({"thin": 3, "engine": "svi"}, "order 5, svi, one in 3 sources"),
        ({"svi": SviSettings(seed=3)}, "order 5, svi seed 3"),
        ({"exclusions": Subset(detectors=frozenset({1}))}, "order 5, without detector 1"),
        (
            {"exclusions": Subset(frozenset(range(132)), detectors=frozenset({1}))},
            "order 5, without 132 sources, without detector 1",
        ),
        ({"prior_shifts": {"detector_x[2]": -5.0}}, "order 5, detector_x[2]=-5um"),
        ({"max_iterations": 9, "robust": True}, "order 5, at most 9 iterations, without outliers"),
    ],
)
def test_description_names_every_setting_that_is_not_its_default(changes, text):
    assert FitSettings(**changes).describe() == text
