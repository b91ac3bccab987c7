"""An orbit without and with defects, measured with the same random numbers."""

from dataclasses import replace

import numpy as np
import pytest

from solver.data.instrument import MINI_MOCK
from solver.data.schema import MEASUREMENT
from solver.simulate.catalogue import truth_catalogue
from solver.simulate.measure import measure_orbit
from solver.simulate.placement import place_detectors
from solver.simulate.settings import SurveySettings

ORBIT = 1
KEY = list(MEASUREMENT.key)
SETTINGS = SurveySettings(
    orbits=3,
    seed=4,
    n_stars=2500,
    n_reference=600,
    n_artificial=40,
    detector_offset_um=30.0,
    detector_rotation_deg=0.03,
    magnitudes=True,
)
QUIET = replace(SETTINGS, measurement_mas=1e-9)


@pytest.fixture(scope="package")
def truth():
    return truth_catalogue(SETTINGS)


@pytest.fixture(scope="package")
def measure(truth):
    """Return the function that measures the orbit with defects."""
    known = {}

    def measured(*defects, settings=SETTINGS, instrument=MINI_MOCK):
        chosen = replace(settings, defects=defects)
        key = (chosen, instrument)
        if key not in known:
            known[key] = measure_orbit(ORBIT, truth, chosen, instrument)
        return known[key]

    return measured


@pytest.fixture(scope="package")
def compare(measure):
    """Return the function that gives the noiseless rows, and how a defect moves them: dx, dy.

    `exposure` counts the exposures of the orbit.
    """

    def compared(*defects, settings=QUIET):
        without, with_defects = (
            measure(*names, settings=settings).measurements.set_index(KEY).sort_index()
            for names in ((), defects)
        )
        rows = without.join(with_defects[["nx", "ny"]].add_suffix("_defect"), how="inner")
        rows = rows.assign(dx=rows["nx_defect"] - rows["nx"], dy=rows["ny_defect"] - rows["ny"])
        rows = rows.reset_index()
        return rows.assign(exposure=rows["field_id"] * 24 + rows["plate_id"])

    return compared


def on_focal_plane(rows, *columns):
    """Return pixels of detectors as vectors on the focal plane, um, without the centres."""
    detectors = place_detectors(MINI_MOCK, SETTINGS).detectors
    angle = -np.radians([d.rotation_deg for d in detectors])[rows["detector_id"]]
    pitch = np.array([(d.pitch_x_um, d.pitch_y_um) for d in detectors])[rows["detector_id"]]
    x, y = (pitch * rows[list(columns)].to_numpy()).T
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y], axis=1)


def places(rows):
    """Return the positions on the undistorted focal plane, um, to the first order."""
    detectors = place_detectors(MINI_MOCK, SETTINGS).detectors
    centre = np.array([(d.x_um, d.y_um) for d in detectors])[rows["detector_id"]]
    focal = centre + on_focal_plane(rows, "nx", "ny")
    a_kl, b_kl = np.zeros((6, 6)), np.zeros((6, 6))
    for k, j, a, b in SETTINGS.distortion_um:
        a_kl[k, j], b_kl[k, j] = a, b
    value = np.polynomial.legendre.legval2d
    at = focal / MINI_MOCK.distortion_scale_um
    return focal - np.stack([value(*at.T, kl) for kl in (a_kl, b_kl)], axis=1)
