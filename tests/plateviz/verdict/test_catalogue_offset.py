"""The reference stars of a catalogue against its other stars."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.verdict.verdict import orbit_verdict
from solver.fit import fit_orbit
from solver.simulate.settings import SurveySettings
from solver.units import MAS_PER_DEG
from tests.campaigns.defects import defective_orbit

SPARSE = SurveySettings(orbits=2, seed=5).scaled(8000)


def judged(milliarcseconds):
    """Return the verdict where the catalogue has the reference stars that far to the north."""
    orbit, _ = defective_orbit(SPARSE, 0)
    catalogue = orbit.catalogue.copy()
    catalogue["dec"] += np.where(catalogue["is_reference"], milliarcseconds / MAS_PER_DEG, 0.0)
    return orbit_verdict(fit_orbit(replace(orbit, catalogue=catalogue)))


@pytest.mark.parametrize("milliarcseconds", [1000.0, -700.0])
def test_reference_stars_that_are_displaced_together_are_not_trusted(milliarcseconds):
    verdict = judged(milliarcseconds)
    assert verdict.state == "bad"
    (cause,) = (one for one in verdict.causes if one.name == "catalogue-offset")
    assert verdict.headline.endswith(f": {cause.title}.")
    said = cause.words.partition(" mas in δ")[0].rsplit(" and ")[-1]
    found, error = map(float, said.replace(",", "").replace("−", "-").split(" ± "))
    # The reference stars take the others along.
    assert abs(found - milliarcseconds) < 4.0 * error


def test_offset_that_the_other_stars_may_have_is_said_and_no_fault():
    verdict = judged(300.0)
    assert verdict.state == "good"
    (said,) = (one for one in verdict.notable if "other stars are" in one)
    assert "If the reference stars are displaced, so are all positions" in said


def test_catalogue_that_is_one_has_no_offset():
    verdict = judged(0.0)
    assert verdict.state == "good"
    assert not any("other stars are" in one for one in verdict.notable)
