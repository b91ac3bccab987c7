"""Causes that another one, or their own size, would hide."""

from dataclasses import replace

import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.priors import prior_rms
from solver.results.diagnosis.table import diagnose
from tests.solver.results.test_diagnosis import fitted, orbit_of


def subjects(result):
    return [one.test.subject for one in find_causes(diagnose(result)).found]


@pytest.mark.parametrize("noise", ["noise=15%", "noise=-20%"])
def test_tails_do_not_hide_noise_of_another_size(noise):
    """The outliers that are too small to be found make tails."""
    data = orbit_of("outliers=1%", noise)
    diagnosis = diagnose(fit_orbit(data, settings=FitSettings(robust=True)))
    kurtosis = next(one for one in diagnosis.tests if one.subject == "kurtosis")
    assert kurtosis.sigma > 3.0
    assert find_causes(diagnosis).found[0].test.subject == "noise"


@pytest.mark.parametrize("width", [0.1, 1e-3])
def test_prior_is_named_however_narrow_it_is(width):
    """The narrower it is, the closer to its centre it holds the values."""
    settings = FitSettings(prior_widths={"position_angle": width})
    result = fit_orbit(orbit_of(), settings=settings)
    assert subjects(result)[0] == "prior"
    (found,) = (one for one in prior_rms(result) if one.group == "position_angle")
    assert found.rms > 4.0
    rows = result.calibration.query("group == 'position_angle'")
    assert np.sqrt(np.mean((rows["offset"] / width) ** 2)) < found.rms


@pytest.mark.full
def test_wrong_identifications_are_named_where_they_bend_the_whole_fit():
    """With one in a hundred, chi2 is a million: sources and reference stars are off, too."""
    assert subjects(fitted("swapped=1%")) == ["swapped"]


def test_noise_does_not_make_stars_wrong():
    """What reference stars gain is by the scatter of the residuals, as for all other causes."""
    clean = fitted()
    sources = clean.sources.copy()
    star = sources.index[sources["is_reference"] & (sources["n_obs"] > 20)][0]
    sources.loc[star, "offset_ra"] += 2.0
    diagnosis = diagnose(replace(clean, sources=sources))
    gains = [
        next(one.gain for one in find_causes(found).found if one.test.subject == "reference")
        for found in (diagnosis, diagnosis._replace(scale=2.0))
    ]
    assert gains[0] > 1.9 * gains[1]


@pytest.mark.parametrize(
    ("defect", "subject"),
    [("detector-shift=3um", "shift"), ("exposure-times=1000d", "epoch")],
)
def test_large_error_is_named_alone(defect, subject):
    """It bends the fit, and leaves residuals that look like noise and like other patterns."""
    assert subjects(fitted(defect)) == [subject]


def test_what_patterns_explain_is_not_taken_from_other_exposures_than_those_they_explain():
    """Those with much jitter leave patterns, and are left out where the noise is looked at."""
    causes = find_causes(diagnose(fitted("pointing-jitter=100mas", orbit=10)))
    assert [one.test.subject for one in causes.found] == ["swing"]
    assert causes.left is None
