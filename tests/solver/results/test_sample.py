"""Samples of the measurements: which sources and which exposures stand for all."""

import numpy as np
import pandas as pd
import pytest

from solver.results.diagnosis import sample
from solver.results.diagnosis.rows import Camera, Rows
from solver.results.diagnosis.sample import gauss_quadrature, sample_of


def test_sources_of_a_sample_are_spread_over_the_sky():
    """Also where right ascension passes zero; the reference sources are sampled by themselves."""
    random = np.random.default_rng(0)
    ra, dec = random.uniform(-0.5, 0.5, (2, 4000))
    sources = pd.DataFrame({"ra": ra % 360.0, "dec": dec, "is_reference": ra < -0.4})
    order = sample._along_the_sky(sources)
    chosen = sources.iloc[order[::10]]
    cells = (chosen["ra"] + 0.5) % 360.0 // 0.25 * 4 + (chosen["dec"] + 0.5) // 0.25
    counts = np.bincount(cells.astype(int), minlength=16)
    assert counts.sum() == 400
    # Drawn at random, they would scatter by 5.
    assert np.std(counts) < 3
    assert chosen["is_reference"].mean() == pytest.approx(sources["is_reference"].mean(), abs=0.003)


def test_sources_at_equal_steps_are_within_their_number():
    """Rounding made one of 8,311 sources the one after the last."""
    for count in range(1801, 9000):
        places = sample._at_steps(count, count / 1800)
        assert 1800 <= len(places) <= 1801
        assert places[-1] < count


@pytest.mark.parametrize("count", [1, 4, 7])
def test_quadrature_is_exact_for_polynomials(count):
    random = np.random.default_rng(3)
    time, weight = np.sort(random.uniform(0.2, 0.4, 24)), random.uniform(0.5, 2.0, 24)
    nodes, weights = gauss_quadrature(time, weight, count)
    assert np.all(np.diff(nodes) > 0.0)
    assert time[0] < nodes[0]
    assert nodes[-1] < time[-1]
    assert np.all(weights > 0.0)
    for degree in range(2 * count):
        assert weights @ nodes**degree == pytest.approx(weight @ time**degree, rel=1e-9, abs=0.0)


@pytest.mark.parametrize("time", [[-0.5], [0.0] * 30, [-0.5, *[0.5] * 29]], ids=len)
def test_exposures_of_few_different_times_are_all_taken(time):
    """One exposure, or many that a table gives the same time."""
    number, stars = len(time), 3
    camera = Camera(*[None] * len(Camera._fields))._replace(
        time=np.array(time),
        phase=2.0 * np.array(time),
        span=np.zeros(number, dtype=int),
    )
    exposure = np.repeat(np.arange(number), stars)
    rows = Rows(*[exposure] * len(Rows._fields))._replace(
        source=np.tile(np.arange(stars), number),
        first=stars * np.arange(number + 1),
        runs=stars * np.arange(number),
        weight=np.ones(number * stars),
    )
    found = sample_of(rows, camera, pd.DataFrame({"ra": np.zeros(stars)}))
    assert found.share == 1.0
    assert found.parts[0].n == rows.n
    np.testing.assert_array_equal(found.parts[0].weight, rows.weight)
    np.testing.assert_array_equal(found.camera.time, camera.time)
    np.testing.assert_array_equal(found.camera.phase, camera.phase)
