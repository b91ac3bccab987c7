"""A fit that starts from the tables of a solution."""

import numpy as np
import pandas as pd
import pytest

from solver.data.instrument import MINI_MOCK
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import find_mode
from solver.engines.start_tables import StartTables
from solver.fit import OrbitFitter
from solver.problem.problem import build_problem


@pytest.fixture(scope="module")
def result(small_orbit):
    return OrbitFitter(small_orbit.data).fit(FitSettings())


@pytest.fixture(scope="module")
def tables(result):
    return StartTables(result.calibration, result.sources)


@pytest.fixture(scope="module")
def problem(small_orbit):
    return build_problem(small_orbit.data, MINI_MOCK, FitSettings())


def test_fit_from_its_solution_is_a_single_step(problem, tables, result):
    start = tables.point(problem)
    mode = find_mode(problem, FitSettings(), start=start)
    assert mode.status.is_solution
    assert len(mode.trace) == 2
    sigmas = result.sources["sigma_ra_conditional"].to_numpy()
    assert (np.abs(mode.sources[:, 0] - start.sources[:, 0]) < 1e-3 * sigmas).all()
    by_column = np.concatenate([problem.layout.columns(g) for g in problem.layout.groups])
    assert np.array_equal(start.theta[by_column], result.calibration["offset"])


def test_what_ifs_are_those_after_a_fit_from_the_priors(small_orbit, tables, monkeypatch):
    settings = FitSettings(prior_widths={"sources": 3.0})
    found = []
    for solution in (None, tables):
        fitter, iterations = OrbitFitter(small_orbit.data), []
        fitter.prepare_what_ifs(FitSettings(), iterations.append, solution)
        found.append((fitter.what_if(settings).sources, len(iterations)))
    (expected, n_before), (sources, n_steps) = found
    assert n_steps == 2 < n_before
    for name in ("offset_ra", "offset_dec", "sigma_ra_marginal"):
        sigma = expected["sigma_ra_marginal"]
        assert (np.abs(sources[name] - expected[name]) < 1e-3 * sigma).all()


def test_tables_of_something_else_do_no_harm(small_orbit, tables):
    far = tables.calibration.assign(offset=lambda rows: 1000.0 * rows["offset"])
    fitter = OrbitFitter(small_orbit.data)
    fitter.prepare_what_ifs(FitSettings(), solution=tables._replace(calibration=far))
    assert fitter.fitted_settings == FitSettings()


@pytest.mark.parametrize(
    "change",
    [
        lambda t: {"calibration": t.calibration[t.calibration["group"] != "pointing_ra"]},
        lambda t: {"calibration": t.calibration.iloc[:-1]},
        lambda t: {"calibration": pd.concat([t.calibration, t.calibration.iloc[:1]])},
        lambda t: {"calibration": t.calibration.assign(offset=np.nan)},
        lambda t: {"sources": t.sources.iloc[1:]},
        lambda t: {"sources": t.sources.iloc[::-1]},
        lambda t: {"sources": t.sources.assign(offset_ra=np.inf)},
    ],
    ids=["group", "element", "more", "no-number", "fewer-sources", "order", "infinite"],
)
def test_tables_of_other_parameters_are_no_start(problem, tables, change):
    assert tables.point(problem) is not None
    assert tables._replace(**change(tables)).point(problem) is None


def test_other_order_is_no_start(small_orbit, tables):
    lower = build_problem(small_orbit.data, MINI_MOCK, FitSettings(order=4))
    assert tables.point(lower) is None
