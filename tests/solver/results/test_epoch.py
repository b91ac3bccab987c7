"""A wrong time of all exposures: found from the proper motions of the reference stars."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz.verdict.verdict import orbit_verdict
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.contradictions import beyond_shift, of_epoch
from solver.results.diagnosis.epoch import EpochOffset, epoch_offset
from solver.results.diagnosis.found import Found
from solver.results.diagnosis.references import catalogue_chi2
from solver.results.diagnosis.table import diagnose
from solver.units import DAYS_PER_JULIAN_YEAR
from tests.solver.results.test_diagnosis import fitted

# Of the catalogue and of the measurements without it, mas.
PRIOR, MEASURED = 0.3, 0.9
N = 400


def stars(days, seed, *, error=PRIOR, n=N):
    """Reference stars that are measured so many days later than their times say."""
    rng = np.random.default_rng(seed)
    motion = rng.normal(0.0, 6.0, (n, 2)) + [3.0, -2.0]
    catalogue = rng.normal(0.0, error, (n, 2))
    measured = motion * days / 365.25 + rng.normal(0.0, MEASURED, (n, 2)) + [0.2, 0.1]
    share = PRIOR**2 / (PRIOR**2 + MEASURED**2)
    offset = share * (measured - catalogue)
    sigma = PRIOR * np.sqrt(1.0 - share)
    return pd.DataFrame(
        {
            "source_id": np.arange(n),
            "is_reference": True,
            **{f"prior_pm{axis}": motion[:, i] for i, axis in enumerate(("ra", "dec"))},
            **{f"offset_{axis}": offset[:, i] for i, axis in enumerate(("ra", "dec"))},
            **{f"prior_sigma_{axis}": PRIOR for axis in ("ra", "dec")},
            **{f"sigma_{axis}_marginal": sigma for axis in ("ra", "dec")},
            "prior_corr": 0.0,
            "corr_marginal": 0.0,
        }
    )


def pulls(days, **changes):
    found = [epoch_offset(stars(days, seed, **changes)) for seed in range(60)]
    return np.array([(one.days - days) / one.sigma for one in found])


@pytest.mark.parametrize("days", [0.0, -150.0, 30.0])
def test_interval_is_found_within_its_uncertainty(days):
    found = pulls(days)
    assert abs(found.mean()) < 3.0 / np.sqrt(len(found))
    assert 0.75 < found.std() < 1.25


def test_errors_that_the_catalogue_states_too_small_widen_the_uncertainty():
    assert 0.75 < pulls(0.0, error=10.0 * PRIOR).std() < 1.25


def test_some_wrong_stars_do_not_change_it():
    rows = stars(-150.0, 1)
    wrong = rows.copy()
    wrong.loc[::40, "offset_ra"] += 30.0
    one, other = epoch_offset(rows), epoch_offset(wrong)
    assert abs(one.days - other.days) < one.sigma
    assert one.sigma == pytest.approx(other.sigma, rel=0.1)


def test_stars_are_where_the_catalogue_has_them_at_the_other_time():
    rows = stars(-150.0, 2)
    off, moved = catalogue_chi2(rows), catalogue_chi2(EpochOffset(-150.0, 1.0).moved(rows))
    assert off.factor > 3.0
    assert moved.factor < 1.3
    assert rows.equals(stars(-150.0, 2))


@pytest.mark.parametrize(
    "unknown",
    [
        lambda rows: rows.drop(columns=["prior_pmra", "prior_pmdec"]),
        lambda rows: rows.assign(prior_pmra=np.nan),
        lambda rows: rows.assign(is_reference=False),
        lambda rows: rows.assign(prior_pmra=1.0, prior_pmdec=-2.0),
        lambda rows: rows.head(5),
    ],
    ids=["older result", "no motions", "no references", "the same motions", "too few"],
)
def test_without_stars_that_tell_it_is_unknown(unknown):
    found = epoch_offset(unknown(stars(100.0, 3)))
    assert np.isnan(found.days)
    assert np.isnan(found.sigma)


@pytest.mark.parametrize(("defect", "how"), [("100d", "too late"), ("-100d", "too early")])
def test_verdict_says_by_how_much_the_times_are_wrong(defect, how):
    verdict = orbit_verdict(fitted(f"exposure-times={defect}"))
    (cause,) = verdict.causes
    assert (verdict.state, cause.name) == ("bad", "wrong-epoch")
    assert f"days {how}, or the epoch of the catalogue" in cause.words
    days = float(cause.words.partition("exposures are ")[2].split()[0])
    assert days == pytest.approx(100.0, abs=20.0)


def test_star_that_moves_most_may_contradict_the_others():
    """It is further off than doubles are, and left out of the test."""
    diagnosis = diagnose(fitted("exposure-times=60d"))
    (found,) = of_epoch(diagnosis)
    rows = diagnosis.result.sources.copy()
    stars = rows[rows["is_reference"] & (rows["n_obs"] > 20)]
    fastest = np.hypot(stars["prior_pmra"], stars["prior_pmdec"]).idxmax()
    years = -found.size / DAYS_PER_JULIAN_YEAR
    for axis in ("ra", "dec"):
        rows.loc[fastest, f"offset_{axis}"] += 20.0 * years * rows.loc[fastest, f"prior_pm{axis}"]
    result = replace(diagnosis.result, sources=rows)
    assert epoch_offset(rows).days == pytest.approx(found.size, abs=found.test.scatter)
    assert of_epoch(diagnosis._replace(result=result)) == []


def test_good_solution_says_which_time_it_would_not_notice():
    reasons = " ".join(orbit_verdict(fitted()).reasons)
    assert "A time that is wrong in all exposures alike, by less than" in reasons


@pytest.mark.full
def test_wrong_epoch_is_named_beside_a_pattern_only_if_it_is_beyond_what_that_shifts():
    drift = "distortion-drift=0.5um"
    together = find_causes(diagnose(fitted(drift, "exposure-times=-200d"))).found
    assert [one.test.subject for one in together] == ["drift", "epoch"]
    diagnosis = diagnose(fitted(drift))
    found = Found(next(one for one in diagnosis.tests if one.subject == "epoch"), 0.0)
    assert beyond_shift(diagnosis, found, 10.0) == []
