"""The calibration is saved with all digits and units, in every format."""

from dataclasses import replace

import numpy as np
import pytest
from astropy.table import Table

from plateviz.dashboard.saving.calibration_files import calibration_files
from plateviz.dashboard.saving.downloads import FORMATS, as_file
from plateviz.dashboard.views.dialogs.solution_dialog import SolutionDialog
from plateviz.dashboard.views.panes.calibration import CalibrationView
from plateviz.dashboard.views.panes.compare import CompareView
from plateviz.dashboard.views.saving.save_button import SaveButton
from solver.data.parameters import PARAMETERS
from tests.plateviz.dashboard.navigation.test_navigation import end_job


@pytest.fixture
def robust(fit_result):
    """A result with two outliers."""
    rows = fit_result.residuals.iloc[:2]
    names = ("orbit_id", "field_id", "plate_id", "detector_id", "source_id")
    outliers = rows[list(names)].assign(residual_x=1.0 / 3.0, distance=7.123456789)
    return replace(fit_result, outliers=outliers)


def test_values_are_those_of_the_result(robust):
    tables = calibration_files(robust)
    assert list(tables) == ["exposures", "detectors", "distortion", "outliers"]
    for group in PARAMETERS:
        if group.axis not in ("exp", "det", "coef") or group.setting:
            continue
        table = next(one for one in tables.values() if f"{group.name}_value" in one.colnames)
        rows = robust.calibration[robust.calibration["group"] == group.name]
        assert np.array_equal(table[f"{group.name}_value"], rows["value"])
        sigmas = table[f"{group.name}_sigma_marginal"]
        assert np.array_equal(sigmas, rows["sigma_marginal"])
        assert table[f"{group.name}_value"].unit == (group.value_unit or None)
        assert sigmas.unit == (group.unit or None)
        assert group.label in sigmas.description
    exposures, outliers = tables["exposures"], tables["outliers"]
    assert np.array_equal(exposures["plate_id"], robust.exposures["plate_id"])
    assert outliers["distance"][0] == 7.123456789


@pytest.mark.parametrize("suffix", FORMATS.values())
def test_every_format_takes_the_tables(robust, suffix):
    made = as_file(calibration_files(robust), "calibration", suffix)
    assert len(made.content) > 1000


def saved(view, label, monkeypatch):
    (button,) = view.__panel__().select(SaveButton)
    sent = []
    monkeypatch.setattr(SaveButton, "_send_msg", lambda _, message: sent.append(message))
    button._handle_msg(label)
    return button, sent[0]


def test_calibration_workspace_saves_its_tables(navigation, monkeypatch):
    view = CalibrationView(navigation.session)
    assert not view._save.visible
    navigation.open_orbit(0)
    button, made = saved(view, "FITS", monkeypatch)
    assert button.visible
    assert made["name"] == "orbit-0-calibration.fits"


def test_changes_and_list_of_solutions_are_saved(navigation, monkeypatch):
    view = CompareView(navigation, lambda: None)
    navigation.open_orbit(0)
    assert not view._save.visible
    navigation.session.choices.order = 4
    end_job(navigation)
    button, made = saved(view, "ECSV", monkeypatch)
    assert button.visible
    changes = Table.read(made["content"].decode(), format="ascii.ecsv")
    assert (made["name"], changes.colnames) == (
        "orbit-0-changes.ecsv",
        ["what", "a", "b", "change"],
    )
    assert "Measurements" in list(changes["what"])
    counts = changes[changes["what"] == "Measurements"][0]
    assert int(counts["a"]) == navigation.session.shown.result.summary["n_measurements"] > 1000
    navigation.session.units.unit = "µas"
    _, made = saved(view, "CSV", monkeypatch)
    assert "Common error in δ (µas)" in made["content"].decode()
    dialog = SolutionDialog(navigation)
    dialog.open()
    _, made = saved(dialog, "CSV", monkeypatch)
    lines = made["content"].decode().splitlines()
    assert lines[0] == "orbit,name,settings,made"
    assert lines[1].startswith('0,"",order 4,') or lines[1].startswith("0,,order 4,")
