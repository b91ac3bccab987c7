from dataclasses import replace

import numpy as np
import pytest

from solver.data.parameters import BY_NAME
from solver.data.settings import MAX_ORDER, FitSettings
from solver.errors import InputError
from solver.linear.linearised_chunks import linearised_chunks
from solver.problem.padding import padded_sources
from solver.problem.problem import build_problem, thinned
from tests.solver.small_orbit import Design, epoch_places, make_orbit


def test_measurements_are_in_order_of_exposure_detector_and_source(problem):
    source, exposure, detector = problem.measurements.index
    order = np.lexsort((source, detector, exposure))
    np.testing.assert_array_equal(order, np.arange(problem.n_obs))


def test_rows_refer_to_the_input_table(small_orbit, problem):
    rows = small_orbit.data.measurements.iloc[problem.measurements.row]
    np.testing.assert_array_equal(rows[["nx", "ny"]].to_numpy(), problem.measurements.measured)
    ids = problem.sources["source_id"].to_numpy()[problem.measurements.index.source]
    np.testing.assert_array_equal(ids, rows["source_id"].to_numpy())


def test_sources_are_the_measured_ones_in_ascending_order(small_orbit, problem):
    expected = np.unique(small_orbit.data.measurements["source_id"])
    np.testing.assert_array_equal(problem.sources["source_id"], expected)
    assert problem.n_src < len(small_orbit.data.catalogue)


def test_geometry_is_padded_without_changing_its_rows(problem):
    frame = np.asarray(problem.geometry.source_frame)
    assert len(frame) == 1024
    last = np.tile(frame[problem.n_src - 1], (len(frame) - problem.n_src, 1, 1))
    np.testing.assert_array_equal(frame[problem.n_src :], last)


def test_prior_positions_are_catalogue_positions_at_the_mean_epoch(small_orbit, problem):
    assert problem.epoch == pytest.approx(small_orbit.data.exposures["obstime"].mean())
    ra, dec = np.radians(epoch_places(problem.sources, problem.epoch))
    direction = np.asarray(problem.geometry.source_frame)[: problem.n_src, 0]
    expected = np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], axis=-1)
    np.testing.assert_allclose(direction, expected, atol=5e-15)


def test_sources_factor_widens_their_priors(small_orbit, problem):
    wider = build_problem(
        small_orbit.data, small_orbit.instrument, FitSettings(prior_widths={"sources": 3.0})
    )
    np.testing.assert_allclose(wider.priors.precision, problem.priors.precision / 9.0, rtol=1e-12)


def test_prior_of_a_source_includes_its_proper_motion(problem):
    reference = problem.sources["is_reference"].to_numpy(bool)
    variance = np.linalg.inv(problem.priors.precision)[reference, 1, 1]
    years = 2000.0 + (problem.epoch - 51544.5) / 365.25 - 2016.0
    # Omits only the parallax error of 0.02 mas times less than 1 au.
    expected = 0.05**2 + (0.02 * years) ** 2
    assert (variance >= expected).all()
    np.testing.assert_allclose(variance, expected, atol=0.02**2)


def test_width_in_the_settings_sets_the_priors(small_orbit):
    settings = FitSettings(prior_widths={"position_angle": 60.0})
    problem = build_problem(small_orbit.data, small_orbit.instrument, settings)
    widths = problem.layout.scatter(problem.priors.width)
    np.testing.assert_array_equal(widths["position_angle"], 60.0)


def test_only_focal_lengths_have_gamma_priors(problem):
    flags = problem.layout.scatter(problem.priors.is_gamma.astype(float))
    assert [name for name, values in flags.items() if values.any()] == ["focal_length"]
    assert BY_NAME["focal_length"].family == "gamma"


@pytest.mark.parametrize("velocity", [0.0, 7.6], ids=["earth", "satellite"])
def test_aberration_switch_sets_the_velocity_to_zero(velocity):
    orbit = make_orbit(velocity=velocity)
    off = build_problem(orbit.data, orbit.instrument, FitSettings(aberration=False))
    np.testing.assert_array_equal(off.geometry.velocity, 0.0)


def test_satellite_velocity_is_added_to_that_of_the_earth():
    at_rest, moving = (
        build_problem(orbit.data, orbit.instrument, FitSettings())
        for orbit in (make_orbit(), make_orbit(velocity=7.6))
    )
    added = (moving.geometry.velocity - at_rest.geometry.velocity)[:8] * 299_792.458
    expected = make_orbit(velocity=7.6).data.exposures[[f"satellite_v{a}" for a in "xyz"]]
    np.testing.assert_allclose(added, expected.to_numpy(), atol=1e-9)


def test_unknown_detector_is_refused(small_orbit, with_tables):
    wrong = small_orbit.data.measurements.assign(
        detector_id=small_orbit.data.measurements["detector_id"].replace({3: 17})
    )
    orbit = with_tables(small_orbit, measurements=wrong)
    with pytest.raises(InputError, match=r"detector_id.*\[0, 1, 2, 3\].*found \[17\]"):
        build_problem(orbit.data, orbit.instrument, FitSettings())


def cut_down(n_rows):
    """Return the tables of an orbit with few measurements for its sources."""
    orbit = make_orbit()
    rows = orbit.data.measurements.sort_values("source_id", ignore_index=True).head(n_rows)
    return replace(orbit.data, measurements=rows)


def parameters_at(data, order):
    others = 2 * data.measurements["source_id"].nunique() + 8 * 4 + 4 * 5
    return others + (order + 1) * (order + 2) - 6 if order > 1 else others


def test_too_high_order_is_refused_with_the_highest_possible_one():
    data = cut_down(90)
    orders = range(MAX_ORDER + 1)
    highest = max(n for n in orders if parameters_at(data, n) < 180)
    assert 1 < highest < MAX_ORDER
    with pytest.raises(InputError, match=f"highest order they allow is {highest}$"):
        build_problem(data, Design().instrument, FitSettings(order=highest + 1))
    build_problem(data, Design().instrument, FitSettings(order=highest))


def test_data_too_few_for_any_order_are_refused():
    with pytest.raises(InputError, match="no order fits"):
        build_problem(cut_down(12), Design().instrument, FitSettings(order=0))


def test_thinned_problem_has_the_measurements_of_the_kept_sources(problem, expansion_point):
    theta, sources = expansion_point
    keep = np.arange(problem.n_src) % 3 == 1
    subset = thinned(problem, keep)
    rows = keep[problem.measurements.index.source]
    np.testing.assert_array_equal(subset.measurements.label, problem.measurements.label[rows])
    ids = problem.sources["source_id"].to_numpy()
    np.testing.assert_array_equal(subset.sources["source_id"], ids[keep])
    np.testing.assert_array_equal(
        subset.sources["source_id"].to_numpy()[subset.measurements.index.source],
        ids[problem.measurements.index.source[rows]],
    )
    # The model is that of the full problem: the same measurements have the same residuals.
    whole, found = (
        np.concatenate([np.ravel(c.residual[0]) for c in linearised_chunks(p, theta, s)])[
            p.measurements.tiles.place
        ]
        for p, s in ((problem, sources), (subset, sources[keep]))
    )
    np.testing.assert_allclose(found, whole[rows], atol=1e-6)


def test_thinned_problem_keeps_the_shapes_of_the_full_problem(problem):
    subset = thinned(problem, np.arange(problem.n_src) % 2 == 0)
    assert subset.geometry.source_frame.shape == problem.geometry.source_frame.shape


@pytest.mark.parametrize(
    ("length", "padded"), [(1, 1024), (1024, 1024), (1025, 2048), (8193, 16384)]
)
def test_orbits_of_similar_lengths_share_a_compilation(length, padded):
    assert padded_sources(length) == padded
