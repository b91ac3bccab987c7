import numpy as np
import pandas as pd
import pytest

from solver.data.exclusions import without_excluded
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.problem.adjustments import Adjustments
from solver.problem.priors import Priors
from solver.problem.problem import build_problem
from solver.problem.problem_cache import ProblemCache

DEFAULT = FitSettings(order=3)


@pytest.fixture
def cache(small_orbit):
    return ProblemCache(small_orbit.data, small_orbit.instrument)


def without(orbit, rank):
    ids = np.unique(orbit.data.measurements["source_id"])
    return FitSettings(order=3, exclusions=Subset(sources=frozenset([int(ids[rank])])))


@pytest.mark.parametrize(
    "settings",
    [
        FitSettings(order=2),
        FitSettings(order=4),
        FitSettings(order=3, prior_widths={"sources": 3.0, "detector_x": 7.0}),
        FitSettings(order=3, prior_shifts={"detector_x[1]": 5.0, "focal_length": 1.0}),
        FitSettings(order=3, aberration=False),
    ],
    ids=["lower", "higher", "widths", "centres", "aberration"],
)
def test_cached_problem_equals_one_built_from_the_tables(cache, small_orbit, settings):
    _, first = cache.get(DEFAULT)
    data, found = cache.get(settings)
    assert data is small_orbit.data
    assert found.measurements is first.measurements
    expected = build_problem(data, small_orbit.instrument, settings)
    for name in ("order", "layout", "epoch"):
        assert getattr(found, name) == getattr(expected, name)
    for name in Priors._fields:
        values = getattr(expected.priors, name)
        np.testing.assert_array_equal(getattr(found.priors, name), values, err_msg=name)
    np.testing.assert_array_equal(found.geometry.source_frame, expected.geometry.source_frame)
    np.testing.assert_array_equal(found.geometry.velocity, expected.geometry.velocity)
    for name, values in expected.geometry.origin.items():
        np.testing.assert_array_equal(found.geometry.origin[name], values, err_msg=name)
    assert len(found.source_blocks.blocks) == len(expected.source_blocks.blocks)
    for block, other in zip(found.source_blocks.blocks, expected.source_blocks.blocks, strict=True):
        assert block.places == other.places
        np.testing.assert_array_equal(block.columns, other.columns)


def test_other_exclusions_give_another_problem(cache, small_orbit):
    variants = [DEFAULT, *(without(small_orbit, rank) for rank in range(3))]
    exposure = small_orbit.data.measurements[["field_id", "plate_id"]].iloc[0].tolist()
    exclusions = Subset(exposures=frozenset([tuple(exposure)]), detectors=frozenset([1]))
    variants.append(FitSettings(order=3, exclusions=exclusions))
    variants.append(FitSettings(order=3, thin=2))
    for settings in variants:
        data, problem = cache.get(settings)
        expected = build_problem(
            without_excluded(small_orbit.data, settings.exclusions),
            small_orbit.instrument,
            settings,
        )
        if settings.thin == 1:
            assert_same_measurements(problem, expected)
        else:
            assert problem.n_obs < expected.n_obs
        np.testing.assert_array_equal(
            np.sort(data.measurements.index), np.sort(problem.measurements.label)
        )


def assert_same_measurements(problem, expected):
    """Compare with a problem built from its own tables alone."""
    found, wanted = problem.measurements, expected.measurements
    for name in ("measured", "sigma", "row", "label"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name), err_msg=name)
    for column, other in zip(found.index, wanted.index, strict=True):
        np.testing.assert_array_equal(column, other)
    for name in ("order", "position", "places", "exposures"):
        np.testing.assert_array_equal(getattr(found.sets, name), getattr(wanted.sets, name))
    pd.testing.assert_frame_equal(problem.sources, expected.sources)
    pd.testing.assert_frame_equal(problem.exposures, expected.exposures)
    np.testing.assert_array_equal(problem.priors.precision, expected.priors.precision)


def test_cache_distinguishes_outliers_of_different_fits(cache, small_orbit):
    rows = small_orbit.data.measurements
    _, none = cache.get(DEFAULT)
    for outliers in (rows.iloc[:3], rows.iloc[3:4]):
        _, problem = cache.get(DEFAULT, Adjustments(outliers=outliers))
        remaining = rows.index.difference(outliers.index)
        np.testing.assert_array_equal(np.sort(problem.measurements.label), remaining)
    _, again = cache.get(DEFAULT)
    assert again.n_obs == none.n_obs == len(rows)


def test_cache_keeps_the_latest_problem_and_the_one_that_it_is_made_from(cache, small_orbit):
    _, first = cache.get(DEFAULT)
    _, second = cache.get(without(small_orbit, 0))
    assert cache.get(DEFAULT)[1].measurements is first.measurements
    _, third = cache.get(without(small_orbit, 1))
    assert cache.get(without(small_orbit, 1))[1].measurements is third.measurements
    assert cache.get(DEFAULT)[1].measurements is first.measurements
    assert cache.get(without(small_orbit, 0))[1].measurements is not second.measurements
