from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.results.diagnosis.read_rows import camera_rows
from solver.results.diagnosis.swapped import swapped

PIXELS, SIGMA = 2000.0, 0.01


def made(fitted, seed, n_rows=400, n_groups=3, scatter=5.0, n_swapped=6):
    """Return a result whose residuals are large, and the pairs that have each other's place."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-PIXELS / 2, PIXELS / 2, (n_rows, 2))
    residual = rng.normal(0.0, scatter, (n_rows, 2))
    exposure = np.sort(rng.integers(0, n_groups, n_rows))
    measured = place + residual
    pairs = []
    for group in range(n_groups):
        first, second = rng.choice(np.flatnonzero(exposure == group), (2, n_swapped), replace=False)
        measured[first], measured[second] = measured[second].copy(), measured[first].copy()
        pairs += [frozenset(pair) for pair in zip(first.tolist(), second.tolist(), strict=True)]
    table = pd.DataFrame({"source_id": np.arange(n_rows), "detector_id": 0, "sx": SIGMA})
    columns = {"nx": 0, "ny": 1, "residual_x": 0, "residual_y": 1}
    for name, axis in columns.items():
        table[name] = (measured if name.startswith("n") else measured - place)[:, axis]
    table = table.assign(sy=SIGMA, field_id=0, plate_id=exposure, leverage=0.0)
    table = table.assign(focal_x=table["nx"], focal_y=table["ny"])
    exposures = fitted.exposures.head(n_groups).assign(field_id=0, plate_id=range(n_groups))
    return replace(fitted, residuals=table, exposures=exposures), pairs


def pairs_by_comparing_all(result):
    table, found = result.residuals, set()
    measured = table[["nx", "ny"]].to_numpy()
    residual = table[["residual_x", "residual_y"]].to_numpy()
    length = np.hypot(*residual.T)
    for a in range(len(table)):
        for b in range(a + 1, len(table)):
            near = 0.25 * min(length[a], length[b])
            there = [measured[i] - (measured - residual)[j] for i, j in ((a, b), (b, a))]
            if result.exposure_index[a] == result.exposure_index[b]:
                found |= {frozenset((a, b))} if max(np.hypot(*d) for d in there) < near else set()
    return found


def swapped_in(result):
    return swapped(result, camera_rows(result)[1])


def found_pairs(result):
    return {frozenset(pair) for pair in swapped_in(result).rows.reshape(-1, 2).tolist()}


@pytest.mark.parametrize("seed", range(3))
def test_swapped_measurements_are_found(result, seed):
    result, pairs = made(result, seed)
    assert set(pairs) <= found_pairs(result)
    assert swapped_in(result).log_chance < -20.0


def test_pairs_are_those_that_each_comparison_finds(result):
    """Residuals as large as the distances between stars give pairs by chance as well."""
    result, pairs = made(result, 3, n_rows=200, scatter=60.0)
    expected = pairs_by_comparing_all(result)
    assert found_pairs(result) == expected
    assert expected - set(pairs)


def test_measurements_near_their_places_are_no_pairs(result):
    result, _ = made(result, 4, scatter=0.1 * SIGMA, n_swapped=0)
    assert len(swapped_in(result).rows) == 0
    assert swapped_in(result).log_chance == pytest.approx(0.0)
