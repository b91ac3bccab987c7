"""Options of `fit` and `survey`: one per setting, and the settings that they give."""

import pytest
from typer.main import get_command

from plateviz.cli.main import app
from plateviz.cli.options import fit_settings
from solver.data.engine_settings import ENGINE_OPTIONS, NutsSettings, svi_settings
from solver.data.settings import SETTINGS, FitSettings

COMMANDS = get_command(app).commands


@pytest.mark.parametrize("command", ["fit", "survey"])
def test_command_has_an_option_for_every_setting_it_offers(command):
    found = {name: one for one in COMMANDS[command].params for name in one.opts}
    for one in [*SETTINGS.values(), *ENGINE_OPTIONS.values()]:
        assert (f"--{one.option}" in found) == (bool(one.option) and command in one.commands)
        if f"--{one.option}" in found:
            assert found[f"--{one.option}"].help.startswith(one.help)


def test_settings_without_options_are_the_defaults():
    assert fit_settings({}) == FitSettings()


def test_options_become_settings():
    values = {
        "order": 3,
        "compare_orders": True,
        "prior": ["distortion_x=10um", "pitch_x=flat"],
        "centre": ["detector_x[2]=-5um"],
        "exclude": ["detector=2"],
        "seed": 4,
        "steps": 30,
        "compat": "warpfield",
    }
    found = fit_settings(values)
    assert (found.order, found.compare_orders) == (3, True)
    assert found.prior_widths == {"distortion_x": 10.0, "pitch_x": float("inf")}
    assert found.prior_shifts == {"detector_x[2]": -5.0}
    assert found.exclusions.detectors == {2}
    assert found.svi == svi_settings("warpfield", 30, 4)
    assert found.nuts == NutsSettings(seed=4)
