"""What causes spoil, and by how much."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from plateviz.verdict import star_cause_harm
from plateviz.verdict.cause_case import Case
from plateviz.verdict.cause_harm import harm
from plateviz.verdict.verdict import orbit_verdict
from solver.fit import fit_orbit
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.found import Found
from solver.results.diagnosis.table import Diagnosis, diagnose
from solver.simulate.settings import SurveySettings
from solver.units import MAS_PER_DEG
from tests.campaigns.defects import defective_orbit

SPARSE = SurveySettings(orbits=4, seed=11).scaled(12_000)


def with_noise(result, factor):
    """Return a result with the residuals of each measurement multiplied by a factor."""
    residuals = result.residuals.copy()
    for name in ("residual_x", "residual_y", "normalised_x", "normalised_y"):
        if name in residuals:
            residuals[name] = factor * residuals[name]
    return replace(result, residuals=residuals)


def harm_of(result, subject, *items):
    """Return what a cause spoils in a result, and whether it is much, whatever the tests find."""
    diagnosis = diagnose(result)
    tests = {one.subject: one for one in diagnosis.tests}
    test = tests.get(subject, tests["references"])._replace(subject=subject)
    found = Found(test, 0.0, items, 1.0)
    return harm(Case(found, find_causes(diagnosis), diagnosis, result))


def number_after(words, before):
    return float(words.partition(before)[2].split()[0])


def test_noise_that_is_right_on_the_whole_spoils_the_uncertainties_of_exposures(fit_result):
    # The mean square stays 1.
    factor = np.where(fit_result.exposure_index % 2 == 0, 1.3, np.sqrt(2.0 - 1.3**2))
    spoils, is_large = harm_of(with_noise(fit_result, factor), "exposures")
    assert number_after(spoils, "by about ") == pytest.approx(34.0, abs=6.0)
    assert spoils.endswith("% between exposures, and the weights.")
    assert is_large
    spoils, is_large = harm_of(fit_result, "exposures")
    assert number_after(spoils, "by about ") < 6.0
    assert not is_large


@pytest.mark.parametrize(("factor", "is_much"), [(0.98, False), (1.3, True)])
def test_noise_of_all_spoils_the_uncertainties_by_its_excess(fit_result, factor, is_much):
    spoils, is_large = harm_of(with_noise(fit_result, factor), "noise")
    assert number_after(spoils, "by about ") == pytest.approx(100 * abs(factor - 1), abs=3.0)
    assert is_large == is_much


def test_an_outlier_moves_its_source_by_what_the_fit_has_followed(fit_result):
    residuals = fit_result.residuals.copy()
    row = residuals.index[10]
    moved = []
    for sigmas in (50.0, 100.0):
        residuals.loc[row, "residual_x"] = sigmas * residuals.loc[row, "sx"]
        spoils, _ = harm_of(replace(fit_result, residuals=residuals), "outliers")
        assert "up to 1 sources, by at most" in spoils
        moved.append(number_after(spoils, "by at most "))
    assert moved[0] > 0.0
    assert moved[1] == pytest.approx(2.0 * moved[0], rel=0.1)


def test_outliers_of_one_source_move_it_together(fit_result):
    residuals = fit_result.residuals.copy()
    residuals["sy"] = residuals["sx"]
    star = residuals["source_id"].value_counts().index[0]
    rows = residuals.index[residuals["source_id"] == star][:3]
    moved = []
    for n in (1, 3):
        residuals.loc[rows[:n], "residual_x"] = 60.0 * residuals.loc[rows[:n], "sx"]
        spoils, _ = harm_of(replace(fit_result, residuals=residuals), "outliers")
        moved.append(number_after(spoils, "by at most "))
    assert moved[1] > 1.5 * moved[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "defect", ["distortion-drift=0.3um", "detector-shift=0.4um", "outliers=3%"], ids=str
)
def test_positions_are_off_by_no_more_than_the_most_that_is_said(defect):
    found, without = (
        fit_orbit(defective_orbit(replace(SPARSE, defects=defects), 0)[0])
        for defects in ((defect,), ())
    )
    rows = found.sources.merge(without.sources, on="source_id", suffixes=("", "_without"))
    are_some = defect.startswith("outliers")
    chosen = np.full(len(rows), True) if are_some else ~rows["is_reference"] & (rows["n_obs"] >= 10)
    offset = MAS_PER_DEG * np.stack(
        [
            (rows["ra"] - rows["ra_without"]) * np.cos(np.deg2rad(rows["dec"])),
            rows["dec"] - rows["dec_without"],
        ]
    )
    offset = np.abs(offset[:, chosen])
    error = offset.max() if are_some else np.sqrt(np.mean(offset**2))
    most = number_after(orbit_verdict(found).causes[0].spoils, "at most ")
    assert 0.3 * most < error < most


def test_wrong_reference_star_shifts_the_frame_by_its_share(fit_result, monkeypatch):
    # The first one counts for a fifth of all.
    influence = {"id": ["7", "8"], "residual_ra": [10.0, 1e-6], "pull_ra": [5.0, 1e-6]}
    influence |= {"residual_dec": [1e-6, 1e-6], "pull_dec": [1e-6, 1e-6]}
    table = pd.DataFrame(influence)
    monkeypatch.setattr(star_cause_harm, "reference_influence", lambda _: table)
    spoils, _ = harm_of(fit_result, "reference", 7)
    assert number_after(spoils, "by about ") == pytest.approx(2.0)


@pytest.mark.parametrize(("kurtosis", "word"), [(0.3, "more"), (-0.3, "less")])
def test_noise_with_other_tails_spoils_no_uncertainty_as_a_whole(fit_result, kurtosis, word):
    diagnosis = diagnose(fit_result)
    test = diagnosis.tests[0]._replace(subject="kurtosis", statistic=kurtosis)
    case = Case(Found(test, 0.0), find_causes(diagnosis), diagnosis, fit_result)
    spoils, is_large = harm(case)
    assert spoils.startswith("It spoils no uncertainty as a root mean square")
    assert f"is {word} often far off" in spoils
    assert not is_large


def test_exposure_that_does_not_swing_is_not_said_to_spoil_by_chance(fit_result):
    diagnosis = diagnose(fit_result)
    excess = (diagnosis.exposures.swing * diagnosis.exposures.scale).argsort()[:3]
    spoils, _ = harm_of(fit_result, "swing", *map(int, excess))
    assert number_after(spoils, "these exposures, by ") == 0.0


def test_exposure_that_swings_spoils_much_if_it_moves_its_sources_far(fit_result):
    exposure = 7
    of_it = fit_result.exposure_index == exposure
    moved, large = [], []
    for sigmas in (3.0, 12.0):
        residuals = fit_result.residuals.copy()
        wave = np.sin(2.0 * np.pi * residuals["ny"] / np.ptp(residuals["ny"]))
        residuals["residual_x"] += of_it * sigmas * wave * residuals["sx"]
        swinging = replace(fit_result, residuals=residuals)
        spoils, is_large = harm_of(swinging, "swing", exposure)
        moved.append(number_after(spoils, "these exposures, by "))
        large.append(is_large)
    assert moved[1] == pytest.approx(4.0 * moved[0], rel=0.15)
    assert large == [False, True]


def test_prior_spoils_much_where_the_residuals_show_it(monkeypatch, fit_result):
    nothing = float("nan")
    for others, is_much in (({}, False), ({"noise": nothing}, True), ({"drift": 1.0}, True)):
        found = [
            SimpleNamespace(subject=subject, size_um=size)
            for subject, size in {"prior": nothing, **others}.items()
        ]
        monkeypatch.setattr(Diagnosis, "found", lambda *_, found=found: found)
        spoils, is_large = harm_of(fit_result, "prior")
        assert is_large == is_much
        assert ("mas rms" in spoils) == ("drift" in others)
    # A pattern that is small beside the uncertainties, however certain.
    found = [SimpleNamespace(subject="drift", size_um=1e-6)]
    monkeypatch.setattr(Diagnosis, "found", lambda *_: found)
    assert not harm_of(fit_result, "prior")[1]


def test_catalogue_position_spoils_its_star_by_its_weight_beside_the_measurements(fit_result):
    sources = fit_result.sources.copy()
    star = int(np.flatnonzero(~sources["is_reference"])[2])
    source_id = int(sources.loc[star, "source_id"])
    both = [(f"sigma_{axis}_marginal", f"prior_sigma_{axis}") for axis in ("ra", "dec")]
    for sigma, prior in both:
        sources.loc[star, [sigma, prior]] = 0.5, 10.0
    large = []
    for offset in (40.0, 400.0):
        sources.loc[star, ["offset_ra", "offset_dec"]] = offset
        spoils, is_large = harm_of(replace(fit_result, sources=sources), "other", source_id)
        assert number_after(spoils, "these positions by ") == pytest.approx(offset / 400.0)
        assert "where their uncertainty is 0.5 mas" in spoils
        large.append(is_large)
    assert large == [False, True]


def test_many_wrong_catalogue_positions_pull_the_frame(fit_result):
    sources = fit_result.sources.copy()
    others = ~sources["is_reference"]
    references = float((sources.loc[~others, "prior_sigma_ra"] ** -2.0).sum())
    sources.loc[others, ["prior_sigma_ra", "prior_sigma_dec"]] = 1000.0
    sources.loc[others, ["offset_ra", "offset_dec"]] = 0.0
    shared = np.hypot(fit_result.summary["mean_error_ra"], fit_result.summary["mean_error_dec"])
    offset = shared * references * 1e6 / others.sum()
    sources.loc[others, "offset_ra"] = offset
    spoils, is_large = harm_of(replace(fit_result, sources=sources), "others")
    assert number_after(spoils, "the frame by about ") == pytest.approx(shared, rel=0.05)
    assert is_large
    sources.loc[others, "offset_ra"] = 0.1 * offset
    assert not harm_of(replace(fit_result, sources=sources), "others")[1]
