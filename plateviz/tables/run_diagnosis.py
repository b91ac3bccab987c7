"""All tests of a run with their chance: what single orbits show, all together, and time."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import chdtrc, chdtri

from solver.data.run_schema import RUN_TABLES
from solver.results.diagnosis.rate import (
    log_chance,
    log_chance_binomial,
    log_chance_normal,
    of_many,
    sigmas,
)
from solver.results.diagnosis.survey.trends import Series, Trend, all_series, trend_tests
from solver.results.diagnosis.table import BAD_RATE, CARE_RATE
from solver.results.diagnosis.test import Test, discovered

# Orbits share the catalogue and the distortion, so that these tests are not independent.
_SHARED = ("reference star", "other star", "against their prior")
_LEAST_ORBITS = 2
# chi2 per degree of freedom of all motions that is no discovery yet: what orbits share is not all
# known.
_USUAL = 1.2


@dataclass(frozen=True, eq=False)
class RunTests:
    """The tables from which a run is tested, and what verdict and figures share.

    Attributes
    ----------
    calibrations, orbit_tests, orbit_causes, zonal : `run_schema.CALIBRATIONS`, `ORBIT_TESTS`,
        `ORBIT_CAUSES` and `ZONAL_FIELD`; no rows where they are not known
    """

    calibrations: pd.DataFrame
    orbit_tests: pd.DataFrame
    orbit_causes: pd.DataFrame
    zonal: pd.DataFrame

    @cached_property
    def trends(self) -> tuple[tuple[Series, list[Trend]], ...]:
        """The values of each group of the calibration over the orbits, and their tests."""
        return tuple((series, trend_tests(series)) for series in all_series(self.calibrations))


def no_tests() -> RunTests:
    """Return the tables of a run that cannot be tested, without rows."""
    return RunTests(*(pd.DataFrame(columns=table.names) for table in RUN_TABLES))


class RunDiagnosis(NamedTuple):
    """The tests of a run.

    Attributes
    ----------
    tests : all of them
    trends : the parameter that changes most, of the tests against time; by name of the test
    states : verdict of each orbit
    """

    tests: tuple[Test, ...]
    trends: dict[str, Trend]
    states: pd.Series

    def found(self, rate: float) -> tuple[Test, ...]:
        """Return the tests that are discoveries at a rate of false alarms over all tests."""
        return discovered(self.tests, rate)


def diagnose_run(motions: pd.DataFrame, tables: RunTests) -> RunDiagnosis:
    """Return the tests of a run.

    Parameters
    ----------
    motions : `survey_schema.MOTIONS`, no rows until the orbits are gathered
    tables : of the same run
    """
    states = tables.orbit_causes.drop_duplicates("orbit_id").set_index("orbit_id")["state"]
    trends = [trend for _, of_series in tables.trends for trend in of_series]
    tests = [
        *_shares(states),
        *_together(tables.orbit_tests),
        *_furthest_orbit(tables.orbit_tests),
        *(trend.test for trend in trends),
        *_zonal(tables.zonal),
        *_sources(motions),
        *_most_sources(motions),
    ]
    return RunDiagnosis(tuple(tests), {trend.test.name: trend for trend in trends}, states)


def _shares(states: pd.Series) -> list[Test]:
    """Return the tests of how many orbits are bad, or to be used with care."""
    if len(states) < _LEAST_ORBITS:
        return []
    return [
        _share("orbits with flaws", "care", int((states != "good").sum()), len(states), CARE_RATE),
        _share("bad orbits", "bad", int((states == "bad").sum()), len(states), BAD_RATE),
    ]


def _share(name: str, subject: str, count: int, total: int, rate: float) -> Test:
    chance = log_chance_binomial(count, total, rate)
    scatter = float(np.sqrt(total * rate * (1.0 - rate)))
    return Test(name, subject, (), count, total * rate, scatter, chance, sigmas(chance))


def _together(orbit_tests: pd.DataFrame) -> list[Test]:
    """Return each test of the orbits for all orbits together.

    Minus twice the sum of the logarithms of the chances is a chi2 (Fisher). Tests of what orbits
    share count with the most extreme orbit only.
    """
    tests = []
    for name, rows in orbit_tests.groupby("name", sort=False):
        if len(rows) < _LEAST_ORBITS:
            continue
        chances = np.array([log_chance_normal(float(sigma)) for sigma in rows["sigma"]])
        if any(shared in str(name) for shared in _SHARED):
            chance, dof = of_many(float(chances.min()), len(chances)), 2.0
            statistic = -2.0 * float(chances.min())
            expected = float(chdtri(dof, 0.5 / len(chances)))
        else:
            statistic, dof = -2.0 * float(chances.sum()), 2.0 * len(chances)
            chance, expected = log_chance(statistic, dof), dof
        scatter = float(np.sqrt(2.0 * dof))
        tests.append(
            Test(
                f"all orbits: {name}",
                "together",
                (),
                statistic,
                expected,
                scatter,
                chance,
                sigmas(chance),
            )
        )
    return tests


def _furthest_orbit(orbit_tests: pd.DataFrame) -> list[Test]:
    """Return the test of the most significant one of all tests of all orbits."""
    if orbit_tests["orbit_id"].nunique() < _LEAST_ORBITS:
        return []
    worst = orbit_tests.loc[orbit_tests["sigma"].idxmax()]
    sigma, count = float(worst["sigma"]), len(orbit_tests)
    chance = of_many(log_chance_normal(sigma), count)
    expected = sigmas(float(np.log(0.5 / count)))
    orbit, name = (int(worst["orbit_id"]),), "orbit that is furthest off"
    return [Test(name, "orbit", orbit, sigma, expected, 0.4, chance, sigmas(chance))]


def _zonal(zonal: pd.DataFrame) -> list[Test]:
    if zonal.empty:
        return []
    chi2, dof = float(zonal["chi2"].iloc[0]), float(zonal["dof"].iloc[0])
    chance, scatter = log_chance(chi2, dof), float(np.sqrt(2.0 * dof))
    name = "smooth errors of the catalogue"
    return [Test(name, "zonal", (), chi2, dof, scatter, chance, sigmas(chance))]


def _sources(motions: pd.DataFrame) -> list[Test]:
    """Return the tests of the source, and of the reference star, that scatter most."""
    tests = []
    known = motions[motions["dof"] > 0] if len(motions) else motions
    for is_reference, name in ((False, "source"), (True, "reference star")):
        rows = known[known["is_reference"] == is_reference] if len(known) else known
        if rows.empty:
            continue
        # Of those whose chance is too small to be told from zero, the one with the largest chi2.
        order = np.lexsort((-rows["chi2"], chdtrc(rows["dof"], rows["chi2"])))
        worst = int(order[0])
        chi2, dof = float(rows["chi2"].iloc[worst]), float(rows["dof"].iloc[worst])
        chance = of_many(log_chance(chi2, dof), len(rows))
        of_source = (int(rows["source_id"].iloc[worst]),)
        tests.append(
            Test(
                f"{name} that scatters most between orbits",
                "scatter",
                of_source,
                chi2,
                dof,
                float(np.sqrt(2.0 * dof)),
                chance,
                sigmas(chance),
            )
        )
    return tests


def _most_sources(motions: pd.DataFrame) -> list[Test]:
    """Return the test of how much sources, but reference stars, scatter about their motions."""
    if motions.empty:
        return []
    rows = motions[(motions["dof"] > 0) & ~motions["is_reference"].astype(bool)]
    # Without the tenth that scatters most, which may be double.
    rows = rows.loc[(rows["chi2"] / rows["dof"]).nsmallest(int(0.9 * len(rows))).index]
    if rows.empty:
        return []
    chi2, dof = float(rows["chi2"].sum()), float(rows["dof"].sum())
    chance = log_chance(chi2 / _USUAL, dof)
    scatter = float(np.sqrt(2.0 / dof))
    name = "scatter of most sources between orbits"
    return [Test(name, "motions", (), chi2 / dof, 1.0, scatter, chance, sigmas(chance))]
