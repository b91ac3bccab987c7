"""Defects of the reference catalogue, against the true one."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.errors import InputError
from solver.simulate.catalogue import reference_catalogue
from solver.simulate.defects.stages import defective_catalogue
from solver.simulate.sky import icrs_to_galactic
from tests.solver.simulate.defects.conftest import SETTINGS

FIVE = ["ra", "dec", "pmra", "pmdec", "parallax"]


@pytest.fixture(scope="module")
def reference(truth):
    return reference_catalogue(truth, SETTINGS)


@pytest.fixture
def altered(truth, reference):
    """Return the function that gives the catalogue with a defect."""

    def make(text):
        before = reference.copy()
        result = defective_catalogue(reference, truth, replace(SETTINGS, defects=(text,)))
        pd.testing.assert_frame_equal(reference, before)
        return result

    return make


def test_reference_errors_are_larger_by_the_amplitude(altered, reference, truth):
    catalogue, affected = altered("reference-errors=30%")
    chosen = reference["is_reference"]
    before, after = (
        table.loc[chosen, FIVE] - truth.loc[chosen, FIVE] for table in (reference, catalogue)
    )
    # A degree has rounding errors of 1e-13 deg, 1e-6 of the errors of the reference stars.
    np.testing.assert_allclose(after, 1.3 * before, rtol=1e-3, atol=3e-13)
    others = [name for name in reference if name not in FIVE]
    pd.testing.assert_frame_equal(catalogue[others], reference[others])
    pd.testing.assert_frame_equal(catalogue[~chosen], reference[~chosen])
    assert affected.empty


def test_binaries_are_references_at_the_target_with_wrong_motions(altered, reference):
    catalogue, affected = altered("binaries=5")
    change = catalogue[["pmra", "pmdec"]] - reference[["pmra", "pmdec"]]
    wrong = (change != 0.0).any(axis=1)
    assert set(affected["source_id"]) == set(catalogue["source_id"][wrong])
    assert wrong.sum() == 5
    assert reference["is_reference"][wrong].all()
    np.testing.assert_allclose(np.hypot(*change[wrong].to_numpy().T), 0.5, rtol=1e-9)
    l_deg, b_deg = icrs_to_galactic(*reference.loc[wrong, ["ra", "dec"]].to_numpy().T)
    assert np.abs(l_deg + 0.3).max() <= 0.3
    assert np.abs(b_deg - 0.1).max() <= 0.3
    others = [name for name in reference if name not in ("pmra", "pmdec")]
    pd.testing.assert_frame_equal(catalogue[others], reference[others])


def test_more_binaries_than_reference_stars_are_refused(altered):
    with pytest.raises(InputError, match=r"binaries: expected at most \d+, .* found 5000"):
        altered("binaries=5000")


def test_zonal_errors_have_the_rms_and_are_smooth(altered, reference):
    catalogue, _ = altered("zonal-errors=2mas")
    cos_dec = np.cos(np.radians(reference["dec"]))
    shift = 3.6e6 * (catalogue[["ra", "dec"]] - reference[["ra", "dec"]])
    shift["ra"] *= cos_dec
    rms = np.sqrt(np.mean(shift[reference["is_reference"]] ** 2, axis=0))
    np.testing.assert_allclose(rms, 2.0, rtol=1e-4)
    # Neighbours share them: a cubic polynomial describes them over half a degree.
    at = np.stack([(reference["ra"] - 266.2) * cos_dec, reference["dec"] + 29.1], axis=1)
    near = (np.abs(at) < 0.25).all(axis=1)
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    design = np.stack([at[near, 0] ** i * at[near, 1] ** j for i, j in powers], axis=1)
    assert near.sum() > 3 * len(powers)
    values = shift[near].to_numpy()
    left = values - design @ np.linalg.lstsq(design, values)[0]
    assert np.abs(left).max() < 0.03
    others = [name for name in reference if name not in ("ra", "dec")]
    pd.testing.assert_frame_equal(catalogue[others], reference[others])
