"""Detectors that move within a field, on small orbits of two fields with four exposures each."""

from dataclasses import replace

import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.engines import moves
from solver.fit import OrbitFitter, fit_orbit

MOVING = FitSettings(detector_motion=True)
SHIFT_UM, TURN_ARCSEC = 1.0, 20.0


def moved(orbit, detector, field, plate, *, turn=False):
    """Return the tables with one detector at another place from an exposure of a field on."""
    rows = orbit.data.measurements.copy()
    of = orbit.instrument.detectors[detector]
    later = (rows["field_id"] > field) | ((rows["field_id"] == field) & (rows["plate_id"] >= plate))
    chosen = later & (rows["detector_id"] == of.detector_id)
    x, y = rows.loc[chosen, ["nx", "ny"]].to_numpy().T
    if turn:
        # The detector turns, so that the stars turn back on it.
        angle = np.radians(TURN_ARCSEC / 3600.0)
        shift = angle * y, -angle * x
    else:
        shift = np.full(len(x), -SHIFT_UM / of.pitch_x_um), np.zeros(len(y))
    rows.loc[chosen, ["nx", "ny"]] = np.stack([x + shift[0], y + shift[1]], axis=1)
    return replace(orbit.data, measurements=rows)


def places(result):
    return [(move["field_id"], move["plate_id"]) for move in result.summary["detector_moves"]]


@pytest.fixture(scope="module")
def shifted(small_orbit):
    """Return a fitter of an orbit in which a detector shifts within the second field."""
    field, plates = exposures_of(small_orbit)
    data = moved(small_orbit, 2, field, plates[2])
    return OrbitFitter(data, small_orbit.instrument), (field, plates[2])


def exposures_of(orbit):
    """Return the second field, and its exposures."""
    exposures = orbit.data.exposures
    field = exposures["field_id"].max()
    return int(field), sorted(exposures.loc[exposures["field_id"] == field, "plate_id"])


def test_a_shift_within_a_field_is_found_and_its_size_recovered(shifted, small_orbit):
    fitter, place = shifted
    result = fitter.fit(MOVING)
    assert places(result) == [place]
    assert result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.15)
    rows = result.calibration[result.calibration["group"] == "detector_motion_x"]
    # Detectors by spans; all detectors together move with the pointing.
    along_x = rows["offset"].to_numpy().reshape(4, 2)
    of_one = along_x[2] - np.delete(along_x, 2, axis=0).mean(axis=0)
    # Along the axis of the detector, which is mounted upside down.
    along = np.cos(np.radians(small_orbit.instrument.detectors[2].rotation_deg))
    np.testing.assert_allclose(of_one, [0.0, along * SHIFT_UM], atol=0.15 * SHIFT_UM)
    field, plate = place
    assert rows["label"].iloc[-1].endswith(f"field {field} from plate {plate}")


def test_a_turn_within_a_field_is_found(small_orbit):
    field, plates = exposures_of(small_orbit)
    data = moved(small_orbit, 1, field, plates[1], turn=True)
    assert places(fit_orbit(data, small_orbit.instrument, MOVING)) == [(field, plates[1])]


@pytest.mark.full
def test_two_moves_are_found(small_orbit):
    field, plates = exposures_of(small_orbit)
    data = moved(small_orbit, 0, field, plates[2])
    data = moved(small_orbit._replace(data=data), 3, field - 1, plates[1])
    found = places(fit_orbit(data, small_orbit.instrument, MOVING))
    assert sorted(found) == [(field - 1, plates[1]), (field, plates[2])]


def test_no_move_is_found_where_no_detector_moves_within_a_field(small_orbit):
    field, plates = exposures_of(small_orbit)
    between_fields = moved(small_orbit, 2, field, plates[0])
    for data in (small_orbit.data, between_fields):
        result = fit_orbit(data, small_orbit.instrument, MOVING)
        assert "detector_moves" not in result.summary


def test_exposures_that_each_scatter_are_no_move(small_orbit):
    rows = small_orbit.data.measurements.copy()
    names = ["field_id", "plate_id", "detector_id"]
    group = rows.groupby(names).ngroup().to_numpy()
    jitter = 0.1 * np.random.default_rng(0).standard_normal((group.max() + 1, 2))
    rows[["nx", "ny"]] += jitter[group]
    data = replace(small_orbit.data, measurements=rows)
    assert "detector_moves" not in fit_orbit(data, small_orbit.instrument, MOVING).summary


def test_exposures_of_the_same_time_are_not_divided(shifted, small_orbit):
    _, place = shifted
    exposures = small_orbit.data.exposures.copy()
    exposures["obstime"] = exposures.groupby("field_id")["obstime"].transform("min")
    data = replace(moved(small_orbit, 2, *place), exposures=exposures)
    assert "detector_moves" not in fit_orbit(data, small_orbit.instrument, MOVING).summary


def test_measurements_after_a_move_are_no_outliers(shifted, small_orbit):
    _, place = shifted
    data = moved(small_orbit, 2, *place)
    rows = data.measurements.copy()
    wild = rows.index[::70]
    rows.loc[wild, "nx"] += np.resize([1.0, -2.0], len(wild))
    data = replace(data, measurements=rows)
    result = fit_orbit(data, small_orbit.instrument, MOVING.with_(robust=True))
    assert places(result) == [place]
    assert result.summary["n_outliers"] == len(wild)
    assert result.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.15)


def test_a_what_if_keeps_the_moves(shifted):
    fitter, (field, plate) = shifted
    fitted = fitter.fit(MOVING)
    for settings in (
        MOVING.with_(prior_widths={"pitch_x": 0.005}),
        MOVING.with_(exclusions=Subset(exposures=frozenset({(field, plate + 1)}))),
    ):
        what_if = fitter.what_if(settings)
        assert what_if.summary["detector_moves"] == fitted.summary["detector_moves"]
        assert what_if.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.15)
    # The move has no exposure of its own then.
    without = MOVING.with_(exclusions=Subset(exposures=frozenset({(field, plate)})))
    assert fitter.what_if(without) is None
    assert places(fitter.fit(without)) == [(field, plate + 1)]


def test_exposures_in_which_a_detector_measures_nothing_change_no_chance():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(2, 12, 3, 3))
    gram, along = root @ root.swapaxes(2, 3), 3.0 * rng.normal(size=(2, 12, 3))
    empty = np.zeros((2, 20, 3, 3)), np.zeros((2, 20, 3))
    found = moves._gains(moves._Sums(gram, along))
    parts = zip((gram, along), empty, strict=True)
    both = moves._gains(moves._Sums(*(np.concatenate(pair, axis=1) for pair in parts)))
    for one, other in zip(found, both, strict=True):
        np.testing.assert_allclose(other[:, :11], one, rtol=1e-9)
