"""Difference of two calibrations, against known differences and independent calculations."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest
from numpy.polynomial import legendre

from plateviz import tables
from plateviz.plots.comparison.distortion_comparison import plot_distortion_comparison
from plateviz.tables.distortion_comparison import ALONE, TOGETHER
from plateviz.tables.mean_calibration import fitted_calibration
from solver.data.parameters import OPTIONAL_GROUPS
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.fit import OrbitFitter
from solver.model.forward import Index, image
from solver.problem.problem import build_problem
from solver.simulate.true_calibration import TrueCalibration
from tests.solver.small_orbit import make_orbit

SCALE = 21_000.0
TERMS = [(d - k, k) for d in range(2, 6) for k in range(d + 1)]


def moved(result, **changes):
    """Return the result with values of its calibration changed by functions of their arrays."""
    calibration = result.calibration.copy()
    for group, change in changes.items():
        rows = calibration["group"] == group
        calibration.loc[rows, "value"] = change(calibration.loc[rows, "value"].to_numpy())
    return replace(result, calibration=calibration)


def part_of(table, name):
    return table[table["part"] == name]


def vectors(table):
    return table[["dx_um", "dy_um"]].to_numpy()


def without_similarity(places, difference):
    """Fit and subtract a shift, a roll and a scale, each in a system of its own size."""
    x, y = places.T
    one, zero = np.ones_like(x), np.zeros_like(x)
    columns = [(one, zero), (zero, one), (-y / SCALE, x / SCALE), (x / SCALE, y / SCALE)]
    matrix = np.array([np.concatenate(column) for column in columns]).T
    right = difference.T.ravel()
    found = np.linalg.solve(matrix.T @ matrix, matrix.T @ right)
    return (right - matrix @ found).reshape(2, -1).T


def test_same_solution_has_no_difference(fit_result, instrument):
    table = tables.distortion_comparison(fit_result, fit_result, instrument)
    assert np.abs(vectors(table)).max() < 1e-9
    assert set(table["detector_id"]) == {d.detector_id for d in instrument.detectors}
    half = max(np.abs(d.corners_um()).max() for d in instrument.detectors) / 1000.0
    assert table[["x", "y"]].abs().max().max() == pytest.approx(half, abs=0.02)


def test_another_coefficient_is_its_polynomial_without_the_similarity(fit_result, instrument):
    def changed(values):
        return values + 0.5 * (np.array(TERMS) == (3, 0)).all(axis=1)

    other = moved(fit_result, distortion_x=changed)
    table = tables.distortion_comparison(fit_result, other, instrument)
    places = 1000.0 * part_of(table, ALONE)[["x", "y"]].to_numpy()
    added = 0.5 * legendre.legval(places[:, 0] / SCALE, [0, 0, 0, 1])
    difference = np.stack([added, np.zeros_like(added)], axis=-1)
    expected = without_similarity(places, difference)
    assert np.abs(expected).max() > 0.1
    # Neither detectors nor focal length differ: distortion alone and both together agree.
    for name in (ALONE, TOGETHER):
        assert np.allclose(vectors(part_of(table, name)), expected, atol=1e-3)


@pytest.mark.parametrize(
    ("changes", "removed", "size"),
    [
        ({"detector_x": lambda x: x + 30.0, "detector_y": lambda y: y - 40.0}, "shift_um", 50.0),
        ({"focal_length": lambda f: f * 1.0002}, "scale_ppm", 200.0),
        ({}, "roll_arcsec", 360.0),
    ],
    ids=["shift", "scale", "roll"],
)
def test_what_the_exposures_absorb_is_removed(fit_result, instrument, changes, removed, size):
    """Without distortion, all detectors shifted, rolled or scaled together change nothing."""
    flat = moved(fit_result, distortion_x=np.zeros_like, distortion_y=np.zeros_like)
    if removed == "roll_arcsec":
        angle = np.radians(0.1)
        x, y = flat.values_on("det")[["detector_x", "detector_y"]].to_numpy().T
        changes = {
            "detector_x": lambda _: np.cos(angle) * x - np.sin(angle) * y,
            "detector_y": lambda _: np.sin(angle) * x + np.cos(angle) * y,
            # The rotation of a detector is from the focal plane to its pixels.
            "detector_rotation": lambda degrees: degrees - 0.1,
        }
    table = tables.distortion_comparison(flat, moved(flat, **changes), instrument)
    together = part_of(table, TOGETHER)
    # A rotation by 0.1 deg is not quite a small one: its square is left, which is a scale.
    assert np.abs(vectors(together)).max() < 0.003
    assert abs(together[removed].iloc[0]) == pytest.approx(size, rel=1e-3)
    assert np.abs(vectors(part_of(table, ALONE))).max() < 1e-9


def test_moved_detector_is_seen_with_the_detectors_only(fit_result, instrument):
    other = moved(fit_result, detector_x=lambda x: x + 2.0 * (np.arange(len(x)) == 2))
    table = tables.distortion_comparison(fit_result, other, instrument)
    together = part_of(table, TOGETHER)
    places = 1000.0 * together[["x", "y"]].to_numpy()
    is_moved = (together["detector_id"] == instrument.detectors[2].detector_id).to_numpy()
    # A star is further back on a detector that has moved.
    expected = without_similarity(places, np.outer(is_moved, (-2.0, 0.0)))
    assert np.allclose(vectors(together), expected, atol=2e-3)
    assert np.abs(expected).max() > 1.0
    assert np.abs(vectors(part_of(table, ALONE))).max() < 1e-9


def test_difference_is_given_in_mm_and_mas(fit_result, make_fit_result, instrument):
    table = tables.distortion_comparison(fit_result, make_fit_result(2)[0], instrument)
    focal_um = fit_result.values_on("exp")["focal_length"].mean()
    mas = np.degrees(table["dx_um"] / focal_um) * 3.6e6
    assert np.allclose(table["dx_mas"], mas)
    assert np.allclose(table["u"], table["dx_um"] / 1000.0)
    assert np.allclose(table["v"] * table["mas_per_unit"], table["dy_mas"])


def test_common_shift_of_the_detectors_is_seen_in_the_distortion_alone(fit_result, instrument):
    """About another axis the same cubic distortion has quadratic terms."""
    shift = 50.0

    def coefficients(**values):
        return np.array([values.get(f"t{k}{j}", 0.0) for k, j in TERMS])

    # L3(x - d) = L3(x) - 5 d L2(x) + terms of d squared, and a constant.
    quadratic = -3.0 * 5.0 * shift / SCALE
    one = moved(
        fit_result, distortion_x=lambda _: coefficients(t30=3.0), distortion_y=np.zeros_like
    )
    other = moved(
        one,
        distortion_x=lambda _: coefficients(t30=3.0, t20=quadratic),
        detector_x=lambda x: x + shift,
    )
    table = tables.distortion_comparison(one, other, instrument)
    alone, together = (
        np.sqrt(np.mean(vectors(part_of(table, name)) ** 2)) for name in (ALONE, TOGETHER)
    )
    assert alone > 0.005
    assert together < 0.1 * alone
    assert part_of(table, TOGETHER)["shift_um"].iloc[0] == pytest.approx(shift, rel=1e-3)


@pytest.mark.full
@pytest.mark.slow
def test_left_out_sources_change_the_calibration_within_its_uncertainty():
    orbit = make_orbit(n_sources=150, n_reference=60)
    fitter = OrbitFitter(orbit.data, orbit.instrument)
    fitted = fitter.fit(FitSettings())
    half = frozenset(fitted.sources["source_id"][::2].tolist())
    other = fitter.fit(FitSettings(exclusions=Subset(sources=half)))
    table = part_of(tables.distortion_comparison(fitted, other, orbit.instrument), TOGETHER)
    rms_mas = np.sqrt(np.mean(table[["dx_mas", "dy_mas"]].to_numpy() ** 2))
    single = np.degrees(0.00942 * 10.0 / orbit.instrument.focal_length_um) * 3.6e6
    # The calibration of some 80 parameters from 2 n measured coordinates, each of them noise.
    noise = single * np.sqrt(80.0 / (2.0 * len(fitted.residuals)))
    assert 0.1 * noise < rms_mas < 10.0 * noise


def test_truth_is_compared_as_another_solution(fit_result, make_fit_result, instrument):
    """With the calibration of a fit as the truth, the table is that of two solutions."""
    places = fit_result.values_on("det")
    detectors = tuple(
        replace(one, x_um=x, y_um=y, rotation_deg=turn, pitch_x_um=px, pitch_y_um=py)
        for one, (x, y, turn, px, py) in zip(
            instrument.detectors,
            places[
                ["detector_x", "detector_y", "detector_rotation", "pitch_x", "pitch_y"]
            ].to_numpy(),
            strict=True,
        )
    )
    coefficients = fit_result.values_on("coef")[["distortion_x", "distortion_y"]].to_numpy()
    truth = TrueCalibration(replace(instrument, detectors=detectors), coefficients)
    other = make_fit_result(2)[0]
    found = tables.distortion_truth(other, truth, instrument)
    expected = tables.distortion_comparison(fit_result, other, instrument)
    assert np.abs(vectors(expected)).max() > 0.01
    # The fit's focal length is not the nominal one of the truth: the difference is removed.
    assert np.allclose(vectors(found), vectors(expected), atol=1e-4)
    sigma = other.sources[["sigma_ra_marginal", "sigma_dec_marginal"]].to_numpy()
    assert found["source_mas"].iloc[0] == np.median(sigma)


CAUSES = {
    "own": FitSettings(detector_distortion=3),
    "in-time": FitSettings(drift=2, breathing=2, field_distortion=2, drift_walk=2),
    "detectors": FitSettings(detector_motion=True, focal_anisotropy=True),
}


def test_detector_without_measurements_does_not_count(fit_result, instrument):
    """It is where its prior has it, some 10 µm from where it belongs."""
    left_out = int(instrument.detector_ids[2])
    rows = fit_result.residuals
    without = replace(fit_result, residuals=rows[rows["detector_id"] != left_out])
    found = moved(without, detector_x=lambda v: v + 100.0 * (np.arange(len(v)) == 2))
    table = tables.distortion_comparison(fit_result, found, instrument)
    assert left_out not in set(table["detector_id"])
    assert np.abs(table[["dx_um", "dy_um"]].to_numpy()).max() < 1e-9
    assert set(table["detector_id"]) == set(instrument.detector_ids) - {left_out}


def test_fits_of_different_detectors_have_nothing_to_compare(fit_result, instrument):
    first, *others = instrument.detector_ids
    a, b = (
        replace(fit_result, residuals=fit_result.residuals.query("detector_id in @ids"))
        for ids in ([first], others)
    )
    table = tables.distortion_comparison(a, b, instrument)
    assert table.empty
    figure = plot_distortion_comparison(table, detectors=instrument.detectors)
    assert "No detector" in figure.message


def test_groups_that_are_not_compared_are_named(fit_result, instrument):
    rows = fit_result.calibration
    pitches = rows[rows["group"] == "pitch_x"]
    names = ("magnitude_shift_x", "magnitude_shift_y", "charge_transfer_x", "phase_sine_x")
    shifts = [pitches.assign(group=name) for name in names]
    other = replace(fit_result, calibration=pd.concat([rows, *shifts], ignore_index=True))
    table = tables.distortion_comparison(fit_result, other, instrument)
    named = "shift by magnitude, charge transfer, shift by pixel phase"
    assert set(table["left_out"]) == {named}
    figure = plot_distortion_comparison(table, detectors=instrument.detectors)
    assert all(f"not compared: {named}" in panel.subtitle for panel in figure)
    table = tables.distortion_comparison(fit_result, fit_result, instrument)
    assert set(table["left_out"]) == {""}
    assert "not compared" not in plot_distortion_comparison(table)[0].subtitle


@pytest.fixture(scope="module")
def with_causes():
    """A small orbit with nothing that the paper's model lacks, fitted with causes."""
    orbit = make_orbit()
    fitter = OrbitFitter(orbit.data, orbit.instrument)
    found = {name: fitter.fit(settings) for name, settings in CAUSES.items()}
    return found, orbit.instrument


@pytest.mark.slow
def test_ideal_place_is_where_the_model_images_its_pixel_from(with_causes):
    found, instrument = with_causes
    large = {"own_distortion_x": 3.0, "own_distortion_y": -2.0, "detector_skew": 0.02}
    result = moved(found["own"], **{k: lambda v, add=add: v + add for k, add in large.items()})
    problem = build_problem(make_orbit().data, instrument, result.settings)
    offsets = {
        group.name: jnp.asarray(
            result.values_on(group.axis)[group.name].to_numpy() * group.per_value_unit
            - problem.geometry.origin[group.name]
        )
        for axis in ("det", "coef", "own")
        for group in result.groups_on(axis)
    }
    rng = np.random.default_rng(1)
    numbers = rng.integers(0, len(instrument.detectors), 200)
    pixels = rng.uniform(-900.0, 900.0, (200, 2))
    ideal = fitted_calibration(result, instrument).ideal(
        instrument.distortion_scale_um, numbers, pixels
    )
    zeros = np.zeros_like(numbers)
    index = Index(zeros, zeros, numbers)
    places = jnp.asarray(ideal[:, 0]), jnp.asarray(ideal[:, 1])
    predicted = image(places, offsets, problem.geometry, index).pixel
    np.testing.assert_allclose(np.stack(predicted, axis=-1), pixels, atol=1e-6)


@pytest.mark.slow
def test_causes_that_do_not_depend_on_the_star_are_compared(with_causes):
    found, instrument = with_causes
    for result in found.values():
        assert fitted_calibration(result, instrument).left_out == ()
    star = {"magnitude_shift", "charge_transfer", "pixel_phase"}
    compared = {one.setting for result in found.values() for one in result.settings.optional_groups}
    assert compared == {one.setting for one in OPTIONAL_GROUPS} - star


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "changing", "constant"),
    [
        ("detectors", ("detector_motion_x", 10.0), ("detector_x", 10.0)),
        ("detectors", ("detector_turn", 36.0), ("detector_rotation", 0.01)),
        ("in-time", ("field_distortion_y", 1.0), ("distortion_y", 1.0)),
    ],
)
def test_mean_of_what_changes_with_the_field_is_compared(with_causes, name, changing, constant):
    found, instrument = with_causes
    result = found[name]
    is_later = result.exposures["field_id"] > result.exposures["field_id"].min()

    def added(change, share=1.0):
        group, value = change
        n_low = len([one for one in TERMS if sum(one) <= 2])
        # The terms of the fields end with the second degree.
        size = value * share * np.ones(len(TERMS))
        size[n_low:] = 0.0
        is_term = group == "distortion_y"
        return moved(result, **{group: lambda v: v + (size if is_term else value * share)})

    one, other = added(changing), added(constant, float(is_later.mean()))
    assert np.abs(vectors(tables.distortion_comparison(one, other, instrument))).max() < 1e-6
