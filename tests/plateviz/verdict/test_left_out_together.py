"""Measurements that a robust fit leaves out together."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.verdict.left_out_together import moved_detectors
from plateviz.verdict.verdict import orbit_verdict
from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from solver.simulate.settings import SurveySettings
from solver.units import MAS_PER_DEG
from tests.campaigns.defects import defective_orbit

SPARSE = SurveySettings(orbits=4, seed=11).scaled(12_000)


def robust_fit(defect):
    orbit, _ = defective_orbit(replace(SPARSE, defects=(defect,)), 0)
    return fit_orbit(orbit, settings=FitSettings(robust=True))


@pytest.fixture(scope="module")
def moved():
    """A robust fit of an orbit in which a detector moves by much."""
    return robust_fit("detector-shift=5um")


def test_robust_fit_of_a_detector_that_moves_is_not_trusted(moved):
    sources = moved.sources.merge(moved.true_places, on="source_id", suffixes=("", "_true"))
    off = MAS_PER_DEG * np.abs(sources["ra"] - sources["ra_true"])
    # Some stars are far off, and the tests of the residuals find nothing.
    assert (off > 50.0).sum() > 50
    judged = orbit_verdict(moved)
    assert not any(one.is_found for one in judged.tests)
    assert judged.state == "bad"
    cause = judged.causes[0]
    assert judged.headline.endswith(": detector 3 shifts during the orbit.")
    assert (cause.name, cause.options) == ("detector-shifts", ("--detector-motion",))
    sources_of_it = int(cause.spoils.partition("measured, ")[2].split()[0])
    assert (off > 50.0).sum() <= sources_of_it < 0.3 * len(sources)
    # 5 um are 212 mas.
    assert cause.spoils.partition("about ")[2].startswith("210 mas")


def test_outliers_that_lie_anywhere_are_none_of_a_detector(moved):
    rng = np.random.default_rng(3)
    turn = rng.uniform(0.0, 2.0 * np.pi, len(moved.outliers))
    size = np.hypot(moved.outliers["residual_x"], moved.outliers["residual_y"])
    scattered = moved.outliers.assign(
        residual_x=size * np.cos(turn), residual_y=size * np.sin(turn)
    )
    assert moved_detectors(moved)
    assert not moved_detectors(replace(moved, outliers=scattered))


def test_exposure_that_is_left_out_as_a_whole_is_none_of_a_detector(moved):
    rows = moved.residuals[(moved.residuals.field_id == 1) & (moved.residuals.plate_id == 4)]
    assert rows["detector_id"].nunique() == 4
    lost = rows.assign(residual_x=1.0, residual_y=-2.0)[list(moved.outliers.columns[:9])]
    assert not moved_detectors(replace(moved, outliers=lost))
    of_one = lost[lost["detector_id"] == 2]
    several = np.tile(np.arange(len(of_one)), 4)
    assert moved_detectors(replace(moved, outliers=of_one.iloc[several]))


def test_fit_that_lets_the_detectors_move_has_another_remedy(moved):
    settings = moved.settings.with_(detector_motion=True)
    (cause,) = moved_detectors(replace(moved, settings=settings))
    assert cause.options == ("--exclude detector=3",)


def test_detector_that_is_left_out_altogether_in_a_field_spoils_nothing(moved):
    rows = moved.residuals
    is_one = (rows["field_id"] == 2) & (rows["detector_id"] == 1)
    lost = rows[is_one].assign(residual_x=40.0, residual_y=3.0)[list(moved.outliers.columns[:9])]
    assert not moved_detectors(replace(moved, residuals=rows[~is_one], outliers=lost))
    half = is_one & (np.arange(len(rows)) % 2 == 0)
    kept, some = rows[~half], lost[half[is_one]]
    assert moved_detectors(replace(moved, residuals=kept, outliers=some))
