"""Causes that another may bring about, or that explain a solution nearly as well."""

from dataclasses import replace

import pytest

from solver.fit import fit_orbit
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.contradictions import beyond_shift, of_references
from solver.results.diagnosis.found import CLOSE
from solver.results.diagnosis.table import diagnose
from solver.simulate.settings import SurveySettings
from tests.solver.results import test_diagnosis
from tests.solver.results.test_diagnosis import fitted, orbit_of

SPARSE = SurveySettings(orbits=100, seed=21).scaled(6_000)


def test_course_in_time_that_is_nearly_as_likely_is_a_rival():
    """Over a third of a period an oscillation is nearly straight: a small drift looks like one."""
    found = find_causes(diagnose(fitted("distortion-drift=0.1um")))
    (drift,), (rival,) = found.found, found.rivals
    assert (drift.test.subject, rival.test.subject) == ("drift", "bend")
    assert drift.test.what == rival.test.what
    assert drift.gain - CLOSE < rival.gain


def test_large_drift_has_no_rival():
    assert not find_causes(diagnose(fitted("distortion-drift=0.3um"))).rivals


@pytest.fixture(scope="module")
def shifted():
    """The diagnosis of a sparse orbit whose detector moves by more than the catalogue's errors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(test_diagnosis, "SETTINGS", SPARSE)
        return diagnose(fit_orbit(orbit_of("detector-shift=0.3um")))


def test_reference_stars_that_a_pattern_shifts_are_not_wrong(shifted):
    assert of_references(shifted)
    assert [one.test.subject for one in find_causes(shifted).found] == ["shift"]


def test_reference_star_that_is_further_off_than_a_pattern_shifts_it_is_wrong(shifted):
    sources = shifted.result.sources.copy()
    star = sources.index[sources["is_reference"] & (sources["n_obs"] > 10)][0]
    sources.loc[star, "offset_ra"] += 30.0
    flawed = diagnose(replace(shifted.result, sources=sources))
    (wrong,) = of_references(flawed)
    (left,) = beyond_shift(flawed, wrong, 2.0)
    assert left.test.subject == "reference"
    assert left.items == (int(sources.loc[star, "source_id"]),)
    assert left.test.sigma < wrong.test.sigma
    assert not beyond_shift(flawed, wrong, 1000.0)
