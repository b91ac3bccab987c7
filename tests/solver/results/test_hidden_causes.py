"""Causes that another one, or their own size, would hide."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.priors import prior_rms
from solver.results.diagnosis.read_rows import camera_rows
from solver.results.diagnosis.rows import Rows
from solver.results.diagnosis.table import diagnose
from solver.results.diagnosis.without_exposures import without_exposures
from tests.campaigns.defects import sparse_orbit
from tests.solver.results.test_diagnosis import fitted, orbit_of


def subjects(result):
    return [one.test.subject for one in find_causes(diagnose(result)).found]


@pytest.mark.parametrize("noise", ["noise=15%", pytest.param("noise=-20%", marks=pytest.mark.full)])
def test_tails_do_not_hide_noise_of_another_size(noise):
    """The outliers that are too small to be found make tails."""
    data = orbit_of("outliers=1%", noise)
    diagnosis = diagnose(fit_orbit(data, settings=FitSettings(robust=True)))
    kurtosis = next(one for one in diagnosis.tests if one.subject == "kurtosis")
    assert kurtosis.sigma > 3.0
    assert find_causes(diagnosis).found[0].test.subject == "noise"


def test_uncertainties_in_another_unit_are_named_and_not_the_sources():
    """The priors, which decide then, leave some sources much more than others."""
    data = orbit_of()
    errors = {name: 472.0 * data.measurements[name] for name in ("sx", "sy")}
    result = fit_orbit(replace(data, measurements=data.measurements.assign(**errors)))
    assert subjects(result)[0] == "noise"


@pytest.mark.parametrize("width", [pytest.param(0.1, marks=pytest.mark.full), 1e-3])
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


@pytest.mark.parametrize(
    ("amplitude", "orbit"),
    [
        pytest.param("150mas", 3, marks=pytest.mark.full),
        ("500mas", 1),
        pytest.param("500mas", 3, marks=pytest.mark.full),
    ],
)
def test_large_jitter_names_its_own_exposures_only(amplitude, orbit):
    diagnosis = diagnose(fitted(f"pointing-jitter={amplitude}", orbit=orbit))
    causes = find_causes(diagnosis)
    assert [one.test.subject for one in causes.found] == ["swing"]
    # Those with the largest residuals.
    rows = camera_rows(diagnosis.result)[1]
    chi2 = np.bincount(rows.exposure, rows.chi2) / np.bincount(rows.exposure)
    assert sorted(causes.found[0].items) == sorted(np.argsort(chi2)[-3:])


def test_positions_do_not_carry_jitter_into_the_tests_of_other_exposures():
    diagnosis = diagnose(fit_orbit(sparse_orbit(2, ("pointing-jitter=60mas",))))
    assert [one.test.subject for one in find_causes(diagnosis).found] == ["swing"]
    assert diagnosis.scale < 1.1


def test_residuals_without_an_exposure_are_those_of_the_others_alone():
    """Of one source at a time: its position is the mean of what is left, and its prior."""
    rng = np.random.default_rng(7)
    n, sources = 40, 5
    exposure = np.repeat(np.arange(8), sources)
    roll, variance = rng.uniform(0.0, 6.0, 8), rng.uniform(1.0, 3.0, sources)
    measured, weight = rng.normal(size=(n, 2)), rng.uniform(0.5, 2.0, n)
    source = np.tile(np.arange(sources), 8)
    camera = camera_rows(fitted("pointing-jitter=60mas", orbit=2))[0]._replace(roll=roll)
    is_far = np.zeros(n, dtype=bool)
    is_far[17] = True

    def rows_of(kept):
        """Fit the positions to some rows, with a prior about zero."""
        residual, left = np.empty((n, 2)), np.empty(n)
        for one in range(sources):
            mine = source == one
            used = mine & kept
            precision = weight[used].sum() + 1.0 / variance[one]
            onto_sky = [_turned(angle) for angle in roll[exposure]]
            pull = sum(weight[i] * onto_sky[i] @ measured[i] for i in np.flatnonzero(used))
            for i in np.flatnonzero(mine):
                residual[i] = measured[i] - onto_sky[i].T @ pull / precision
                left[i] = 1.0 - weight[i] / precision
        chi2 = weight * np.square(residual).sum(axis=1)
        residual, places = residual * ~is_far[:, None], 3 * [np.zeros((n, 2))]
        first, zeros = np.arange(0, n + 1, sources), np.zeros(n, dtype=int)
        fitted_to = exposure, zeros, source, np.arange(n), first, first[:-1]
        return Rows(*fitted_to, *places, residual, weight, left, chi2, is_far)

    is_out = np.isin(exposure, [2, 5])
    found = without_exposures(rows_of(exposure >= 0), camera, variance, np.array([2, 5]))
    expected, used = rows_of(~is_out), ~(is_out | is_far)
    for name in ("residual", "left", "chi2"):
        assert_allclose(getattr(found, name)[used], getattr(expected, name)[used], rtol=1e-12)
    assert not found.residual[is_out].any()


def _turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
