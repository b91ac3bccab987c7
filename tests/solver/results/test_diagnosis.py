"""Tests of solutions: their calibration, and the causes that they name."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import find_mode
from solver.fit import fit_orbit
from solver.problem.problem import build_problem
from solver.results.diagnosis import projection, sample
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.columns import columns_at, order_of
from solver.results.diagnosis.patterns import Patterns
from solver.results.diagnosis.priors import prior_rms
from solver.results.diagnosis.projection import covariance_of_products
from solver.results.diagnosis.read_rows import camera_rows
from solver.results.diagnosis.rows import onto_focal_plane
from solver.results.diagnosis.sample import sample_of
from solver.results.diagnosis.table import BAD_RATE, CARE_RATE, diagnose, source_magnitudes
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.defects.stages import defective_catalogue
from solver.simulate.measure import measure_orbit
from solver.simulate.settings import SurveySettings
from tests.solver.conftest import TIGHT_PRIORS

ORDER = 5
# Some 700 sources, with 25,000 measurements.
SETTINGS = replace(SurveySettings(orbits=100, seed=4).scaled(14_000), magnitudes=True)


def orbit_of(*defects, orbit=0):
    """Return a simulated orbit with defects."""
    settings = replace(SETTINGS, defects=defects)
    truth = truth_catalogue(settings)
    catalogue, _ = defective_catalogue(reference_catalogue(truth, settings), truth, settings)
    rows = measure_orbit(orbit, truth, settings)
    measured = truth["source_id"].isin(rows.measurements["source_id"])
    tables = (table[measured].reset_index(drop=True) for table in (catalogue, truth))
    return OrbitData(rows.measurements, rows.exposures, *tables)


def fitted(*defects, orbit=0, order=ORDER):
    """Return the solution of a simulated orbit with defects."""
    return fit_orbit(orbit_of(*defects, orbit=orbit), settings=FitSettings(order=order))


def fitted_with_noise(clean, noise, *defects):
    """Return the solution of an orbit whose noise is replaced, in units of the stated one."""
    data = orbit_of(*defects)
    new = {
        f"n{axis}": data.measurements[f"n{axis}"]
        + (of_axis * clean.residuals[f"s{axis}"] - clean.residuals[f"residual_{axis}"]).to_numpy()
        for axis, of_axis in zip("xy", noise, strict=True)
    }
    data = replace(data, measurements=data.measurements.assign(**new))
    return fit_orbit(data, settings=FitSettings(order=ORDER))


@pytest.fixture(scope="module")
def clean():
    return fitted()


def covariances_of_patterns(fit, problem, dense):
    """Return the covariance of the patterns, and that by the Jacobian of the model, scaled alike.

    Those of the pixel phase are left out: they are for sources in many exposures.
    """
    camera, rows = camera_rows(fit)
    patterns = Patterns(camera, ORDER, np.full(len(fit.sources), np.nan))
    total, left = covariance_of_products(fit, camera, rows, patterns)
    input_rows = np.lexsort((fit.residuals["detector_id"], fit.exposure_index))
    working = np.empty(problem.n_obs, dtype=int)
    working[problem.measurements.row] = np.arange(problem.n_obs)
    scalar, *vectors = columns_at(patterns, rows).parts
    order, none = order_of(patterns, scalar.shape[1]), np.zeros_like(scalar)
    parts = (scalar, none, vectors[0]), (none, scalar, vectors[1])
    columns = [np.concatenate(part, axis=1)[:, order].ravel() for part in parts]
    # Back to the detectors' axes, in units of the uncertainty.
    back = onto_focal_plane(
        np.stack(columns, axis=1), -camera.turn, np.repeat(rows.detector, len(patterns))
    )
    pixels = back.reshape(rows.n, len(patterns), 2).transpose(0, 2, 1)
    pixels *= np.sqrt(rows.weight)[:, None, None]
    whitened = np.empty_like(pixels)
    whitened[working[input_rows]] = pixels
    whitened = whitened.reshape(2 * problem.n_obs, -1)
    along = dense.jacobian.T @ whitened
    exact = whitened.T @ whitened - along.T @ dense.covariance @ along
    # Some cells have no stars.
    slow = np.setdiff1d(np.flatnonzero(np.diag(total)), patterns.fast)
    scale = np.sqrt(np.diag(total)[slow])
    return (one[np.ix_(slow, slow)] / np.outer(scale, scale) for one in (left, exact))


def test_covariance_of_patterns_is_that_of_the_whole_problem(small_orbit, problem, dense):
    """The projection with its own light model, against the Jacobian of the model."""
    settings = FitSettings(prior_widths=TIGHT_PRIORS)
    fit = fit_orbit(small_orbit.data, small_orbit.instrument, settings)
    found, exact = covariances_of_patterns(fit, problem, dense)
    assert np.diag(exact).max() > 0.3
    # Cells at the edge hold a few measurements, whose uncertainties along x and y differ.
    np.testing.assert_allclose(found, exact, atol=0.1)
    assert np.diag(found).mean() == pytest.approx(np.diag(exact).mean(), rel=0.05)


@pytest.mark.parametrize(
    "causes",
    [
        {"drift_walk": 2, "prior_widths": {"drift_walk_x": 0.3, "drift_walk_y": 0.1}},
        *(
            pytest.param(causes, marks=pytest.mark.full)
            for causes in (
                {"drift": 3, "drift_in_time": 2, "focal_anisotropy": True},
                {"breathing": 3, "detector_motion": True},
                {"field_distortion": 2, "charge_transfer": True, "magnitude_shift": True},
                {"detector_distortion": 3, "pixel_phase": True},
            )
        ),
    ],
    ids=lambda causes: next(iter(causes)),
)
def test_covariance_of_patterns_allows_for_modelled_causes(small_orbit, make_dense, causes):
    random = np.random.default_rng(0)
    catalogue = small_orbit.data.catalogue
    magnitude = random.uniform(14.0, 18.0, len(catalogue))
    data = replace(small_orbit.data, catalogue=catalogue.assign(magnitude=magnitude))
    widths = {**TIGHT_PRIORS, **causes.get("prior_widths", {})}
    settings = FitSettings(**{**causes, "prior_widths": widths})
    fit = fit_orbit(data, small_orbit.instrument, settings)
    problem = build_problem(data, small_orbit.instrument, settings)
    mode = find_mode(problem, settings)
    dense = make_dense(problem, mode.theta, mode.sources)
    found, exact = covariances_of_patterns(fit, problem, dense)
    np.testing.assert_allclose(found, exact, atol=0.1)
    assert np.diag(found).mean() == pytest.approx(np.diag(exact).mean(), abs=0.006)


def test_sample_of_the_sources_stands_for_all(clean, monkeypatch):
    """Few sources leave too little of the patterns, so that chi2 is too large; halves tell."""
    camera, rows = camera_rows(clean)
    patterns = Patterns(camera, ORDER, source_magnitudes(clean))
    (above,) = [one for one in patterns.families if one.subject == "order"]

    def left():
        _, found = covariance_of_products(clean, camera, rows, patterns)
        return found[np.ix_(above.columns, above.columns)]

    monkeypatch.setattr(sample, "_LEAST_EXPOSURES", 4)
    monkeypatch.setattr(sample, "_MOST_ROWS", 5000)
    of_all = left()
    monkeypatch.setattr(sample, "_MOST_ROWS", 3000)
    halves = sample_of(rows, camera, clean.sources)
    assert 0.5 < halves.share < 0.8
    assert len(halves.parts) == 2
    sampled = np.isin(rows.source, np.concatenate([part.source for part in halves.parts]))
    both = sample_of(rows.of(np.flatnonzero(sampled)), camera, clean.sources)
    of_sample = left()
    both = both._replace(weight=halves.weight)
    monkeypatch.setattr(projection, "sample_of", lambda *_, **__: both)
    ratios = (np.linalg.solve(one, of_all) for one in (of_sample, left()))
    rise, without = (ratio.trace() / len(of_all) for ratio in ratios)
    assert rise == pytest.approx(1.0, abs=0.1)
    assert rise - 1.0 < 0.6 * (without - 1.0)


@pytest.mark.parametrize("of_span", [2, 4])
@pytest.mark.parametrize("subject", ["shift", "turn", "bend", "step"])
def test_few_exposures_stand_for_all(clean, monkeypatch, subject, of_span):
    """Their times and weights are those of a quadrature: detectors that move in a field show it."""
    camera, rows = camera_rows(clean)
    patterns = Patterns(camera, ORDER, source_magnitudes(clean))

    def left(most):
        monkeypatch.setattr(sample, "_MOST_ROWS", most)
        return covariance_of_products(clean, camera, rows, patterns)[1]

    of_exposure, spans = rows.n // len(camera.time) + 1, camera.span.max() + 1
    few, of_all = left(of_span * spans * of_exposure), left(rows.n)
    for family in (one for one in patterns.families if one.subject == subject):
        of_few, whole = (one[np.ix_(family.columns, family.columns)] for one in (few, of_all))
        known = np.diag(whole) > 0.02 * np.diag(whole).max()
        chi2 = np.trace(np.linalg.solve(of_few[known][:, known], whole[known][:, known]))
        assert chi2 == pytest.approx(known.sum(), rel=0.03)


def test_good_solution_has_no_cause(clean):
    diagnosis = diagnose(clean)
    assert not diagnosis.found(BAD_RATE)
    assert clean.sources["magnitude"].between(5.0, 21.0).all()
    if not diagnosis.found(CARE_RATE):
        assert not find_causes(diagnosis).found


def test_tests_of_a_good_solution_are_those_of_chance(clean):
    chances = np.exp([test.log_chance for test in diagnose(clean).tests])
    assert 0.2 < np.mean(chances) < 0.8
    assert np.all((chances >= 0.0) & (chances <= 1.0))


@pytest.mark.parametrize(
    ("defect", "subject"),
    [
        ("distortion-drift=0.3um", "drift"),
        ("noise=10%", "noise"),
    ],
)
def test_cause_is_named(defect, subject):
    diagnosis = diagnose(fitted(defect))
    causes = find_causes(diagnosis)
    assert diagnosis.found(BAD_RATE)
    assert causes.found[0].test.subject == subject


@pytest.mark.full
@pytest.mark.parametrize(
    ("defect", "subject"),
    [
        ("detector-turn=5arcsec", "turn"),
        ("outliers=0.3%", "outliers"),
        ("swapped=0.2%", "swapped"),
        ("distortion-orbital=0.3um", "bend"),
        ("distortion-step=0.2um", "step"),
        ("distortion-order=0.2um", "order"),
        ("focal-anisotropy=6ppm", "stretch"),
        ("pointing-jitter=10mas", "swing"),
        ("detector-shift=0.2um", "shift"),
        ("charge-transfer=8mpix", "magnitude"),
        ("pixel-phase=6mpix", "phase"),
        ("noise-exposure=30%", "exposures"),
        ("noise-magnitude=30%", "magnitudes"),
        ("binaries=5", "reference"),
        ("reference-errors=500%", "references"),
        ("exposure-times=100d", "epoch"),
    ],
)
def test_every_cause_is_named(defect, subject):
    assert find_causes(diagnose(fitted(defect))).found[0].test.subject == subject


@pytest.mark.parametrize(
    ("defects", "subjects"),
    [
        (("pointing-jitter=8mas", "detector-shift=0.3um"), ["swing", "shift"]),
        (("outliers=0.05%", "detector-shift=0.3um"), ["outliers", "shift"]),
        *(
            pytest.param((one,), [subject], marks=pytest.mark.full)
            for one, subject in (("pointing-jitter=20mas", "swing"), ("outliers=1%", "outliers"))
        ),
    ],
    ids=str,
)
def test_pattern_is_named_beside_what_shifts_stars_if_it_is_more_than_these_carry(
    defects, subjects
):
    found = find_causes(diagnose(fitted(*defects))).found
    assert [one.test.subject for one in found] == subjects


def test_tails_do_not_hide_a_pattern(clean):
    rng = np.random.default_rng(5)
    noise = rng.standard_t(10, (2, len(clean.residuals))) / np.sqrt(1.25)
    found = find_causes(diagnose(fitted_with_noise(clean, noise, "detector-shift=0.1um"))).found
    assert "shift" in [one.test.subject for one in found]


@pytest.mark.parametrize(
    ("order", "orbit"),
    [
        (2, 0),
        *(pytest.param(*one, marks=pytest.mark.full) for one in ((0, 0), (1, 0), (2, 6), (4, 0))),
    ],
)
def test_order_that_is_too_low_is_named(order, orbit):
    """Far too low, what it leaves is neither noise nor outliers nor an error of the catalogue."""
    causes = find_causes(diagnose(fitted(order=order, orbit=orbit)))
    assert [one.test.subject for one in causes.found] == ["order"]


@pytest.mark.full
def test_wrong_identifications_are_named_where_they_make_large_patterns():
    assert find_causes(diagnose(fitted("swapped=0.05%"))).found[0].test.subject == "swapped"


def test_pattern_without_a_cause_is_not_laid_to_a_weak_one(clean):
    """Displaced cells, and a step that is significant, too, but explains little of chi2."""
    diagnosis = diagnose(clean)
    (step, *_) = [one for one in diagnosis.patterns.families if one.subject == "step"]
    amplitude = np.zeros(len(diagnosis.patterns))
    amplitude[step.columns[0]] = 0.05
    with_step = displaced(diagnosis, amplitude)
    assert find_causes(with_step).found[0].test.subject == "step"
    cells = diagnosis.patterns.of_cells()
    amplitude[cells] = np.random.default_rng(0).normal(scale=0.05, size=len(cells))
    assert find_causes(displaced(diagnosis, amplitude)).found[0].test.subject == "map"


def displaced(diagnosis, amplitude):
    """Return the diagnosis if all measurements were displaced by patterns, each so much, um."""
    projection = diagnosis.projection
    products = projection.products + projection.left @ amplitude
    return diagnosis._replace(projection=projection._replace(products=products))


def test_a_drift_is_not_taken_for_an_oscillation(clean, monkeypatch):
    """Over a third of the period these differ by less than a few of the exposures tell."""
    monkeypatch.setattr(sample, "_MOST_ROWS", 3000)
    diagnosis = diagnose(clean)
    _, left = covariance_of_products(
        clean, diagnosis.camera, diagnosis.rows, diagnosis.patterns, all_exposures=True
    )
    exact = diagnosis._replace(projection=diagnosis.projection._replace(left=left))
    (drift, *_) = [one for one in diagnosis.patterns.families if one.subject == "drift"]
    random = np.random.default_rng(0)
    for direction in random.standard_normal((6, len(drift.columns))):
        amplitude = np.zeros(len(diagnosis.patterns))
        amplitude[drift.columns] = 0.5 * direction / np.linalg.norm(direction)
        products = displaced(exact, amplitude).projection.products
        seen = diagnosis._replace(projection=diagnosis.projection._replace(products=products))
        assert find_causes(seen).found[0].test.subject == "drift"


def test_outliers_are_found_and_left_out_of_the_patterns(clean):
    residuals = clean.residuals.copy()
    residuals.loc[[10, 500, 900], "residual_x"] += 40.0 * residuals["sx"].iloc[0]
    _, rows = camera_rows(replace(clean, residuals=residuals))
    assert rows.is_far.sum() == 3
    assert not rows.residual[rows.is_far].any()


def test_exposure_that_swings_is_found(clean):
    residuals = clean.residuals.copy()
    chosen = clean.exposure_index == 7
    wave = 2.0 * np.sin(2.0 * np.pi * residuals["ny"] / np.ptp(residuals["ny"])) * residuals["sx"]
    # All detectors swing along x of the focal plane.
    rotation = np.radians(clean.values_on("det")["detector_rotation"].to_numpy())
    turn = rotation[MINI_MOCK.index_of(residuals["detector_id"].to_numpy())]
    residuals["residual_x"] += chosen * wave * np.cos(turn)
    residuals["residual_y"] += chosen * wave * np.sin(turn)
    diagnosis = diagnose(replace(clean, residuals=residuals))
    assert diagnosis.swinging.tolist() == [7]
    assert find_causes(diagnosis).found[0].items == (7,)


def test_order_of_the_rows_does_not_matter_but_for_rounding(clean):
    shuffled = clean.residuals.sample(frac=1.0, random_state=1, ignore_index=True)
    found = (diagnose(replace(clean, residuals=rows)) for rows in (clean.residuals, shuffled))
    a, b = ([one.statistic for one in each.tests] for each in found)
    assert a == pytest.approx(b, rel=1e-4)


def test_wrong_reference_star_is_named(clean):
    sources = clean.sources.copy()
    wrong = int(np.flatnonzero(sources["is_reference"])[3])
    sources.loc[wrong, "offset_ra"] += 12.0 * sources.loc[wrong, "prior_sigma_ra"]
    found = find_causes(diagnose(replace(clean, sources=sources))).found
    assert found[0].test.subject == "reference"
    assert found[0].items == (int(sources.loc[wrong, "source_id"]),)


def test_other_star_that_is_not_where_the_catalogue_has_it_is_named(clean):
    sources = clean.sources.copy()
    wrong = int(np.flatnonzero(~sources["is_reference"])[3])
    sources.loc[wrong, "offset_ra"] += 12.0 * sources.loc[wrong, "prior_sigma_ra"]
    found = find_causes(diagnose(replace(clean, sources=sources))).found
    assert [one.test.subject for one in found] == ["other"]
    assert found[0].items == (int(sources.loc[wrong, "source_id"]),)


def test_catalogue_that_states_too_small_errors_of_the_other_stars_is_named(clean):
    sources = clean.sources.copy()
    others = ~sources["is_reference"]
    sources.loc[others, ["offset_ra", "offset_dec"]] *= 8.0
    found = find_causes(diagnose(replace(clean, sources=sources))).found
    assert [one.test.subject for one in found] == ["others"]
    assert found[0].size == pytest.approx(8.0, rel=0.15)


def test_catalogue_errors_of_the_other_stars_may_be_bounds(clean):
    sources = clean.sources.copy()
    sources.loc[~sources["is_reference"], ["offset_ra", "offset_dec"]] *= 0.01
    assert not diagnose(replace(clean, sources=sources)).found(CARE_RATE)


def test_stars_without_a_catalogue_position_are_not_compared_with_one(clean):
    sources = clean.sources.copy()
    sources.loc[~sources["is_reference"], ["prior_sigma_ra", "prior_sigma_dec"]] = np.inf
    diagnosis = diagnose(replace(clean, sources=sources))
    assert not len(diagnosis.others.chi2)
    assert not {"other", "others"} & {one.subject for one in diagnosis.tests}


def test_prior_is_named_beside_noise_that_does_not_explain_it(clean):
    residuals, calibration = clean.residuals.copy(), clean.calibration.copy()
    residuals[["residual_x", "residual_y"]] *= 3.0
    pitch = calibration["group"] == "pitch_x"
    for widths, named in ((6.0, ["noise"]), (60.0, ["noise", "prior"])):
        calibration.loc[pitch, "offset"] = widths * calibration.loc[pitch, "prior_sigma"]
        noisy = replace(clean, residuals=residuals, calibration=calibration)
        assert [one.test.subject for one in find_causes(diagnose(noisy)).found] == named


def test_measurements_in_each_others_place_are_found(clean):
    residuals = clean.residuals.copy()
    model = residuals[["nx", "ny"]].to_numpy() - residuals[["residual_x", "residual_y"]].to_numpy()
    # The nearest neighbour of a measurement in its exposure, as in a wrong cross-match.
    key = ["field_id", "plate_id", "detector_id"]
    same = np.flatnonzero((residuals[key] == residuals.loc[0, key]).all(axis=1))
    first, second = same[np.argsort(np.hypot(*(model[same] - model[0]).T))[:2]]
    for one, other in ((first, second), (second, first)):
        residuals.loc[one, ["nx", "ny"]] = model[other] + 0.01
        residuals.loc[one, ["residual_x", "residual_y"]] = model[other] + 0.01 - model[one]
    # One that is far off, and not where another should be.
    residuals.loc[second + 200, "residual_x"] += 5.0
    diagnosis = diagnose(replace(clean, residuals=residuals))
    assert sorted(diagnosis.swapped.rows) == sorted([first, second])
    cause = find_causes(diagnosis).found[0]
    assert cause.test.subject == "swapped"
    assert set(cause.items) == set(residuals.loc[[first, second], "source_id"])
    assert not len(diagnose(clean).swapped.rows)


@pytest.mark.parametrize(
    ("drawn", "more"),
    [
        # Unit variance; the excess kurtosis of the first is 1, of the second -0.6.
        (lambda random, shape: random.standard_t(10, shape) / np.sqrt(1.25), True),
        (lambda random, shape: np.sqrt(1.5) * random.triangular(-2.0, 0.0, 2.0, shape), False),
    ],
    ids=["t", "triangular"],
)
def test_noise_that_is_not_normal_is_named(clean, drawn, more):
    noise = drawn(np.random.default_rng(1), (2, len(clean.residuals)))
    (first,) = find_causes(diagnose(fitted_with_noise(clean, noise))).found
    assert first.test.subject == "kurtosis"
    assert (first.test.statistic > 0.0) == more
    # Both axes together have three quarters of the kurtosis of each if they are independent.
    expected = (1.0 if more else -0.6) * 0.75
    # That of heavy tails scatters several times as much as that of normal ones.
    assert first.test.statistic == pytest.approx(expected, abs=10.0 * first.test.scatter)


def test_noise_that_differs_between_exposures_is_not_heavy_tailed(clean):
    factor = np.where(np.arange(len(clean.exposures)) % 2, 0.3, 1.4)[clean.exposure_index]
    residuals = clean.residuals.copy()
    for axis in "xy":
        residuals[f"residual_{axis}"] *= factor
    diagnosis = diagnose(replace(clean, residuals=residuals))
    (kurtosis,) = [one for one in diagnosis.tests if one.subject == "kurtosis"]
    assert abs(kurtosis.statistic) < 4.0 * kurtosis.scatter
    assert find_causes(diagnosis).found[0].test.subject == "exposures"


def prior_causes(result):
    diagnosis = diagnose(result)
    (test,) = [one for one in diagnosis.tests if one.subject == "prior"]
    found = [one for one in find_causes(diagnosis).found if one.test.subject == "prior"]
    return test, found


def test_values_agree_with_the_priors_that_they_were_drawn_from(clean):
    test, found = prior_causes(clean)
    assert test.statistic < 1.5
    assert not found


def test_prior_that_contradicts_the_measurements_is_named(clean):
    rows = clean.calibration.copy()
    rows.loc[rows["group"] == "pitch_x", "offset"] = 8.0 * rows["prior_sigma"]
    contradicted = replace(clean, calibration=rows)
    test, (found,) = prior_causes(contradicted)
    assert test.name == "values of pitch_x against their prior"
    assert test.statistic == found.size == pytest.approx(8.0, rel=1e-3)
    # The mean square of all values counts as one value, of the worst of some ten groups.
    assert test.sigma == pytest.approx(8.0, abs=0.5)


def test_prior_that_was_set_is_the_first_suspect(clean):
    rows = clean.calibration.copy()
    rows.loc[rows["group"] == "pitch_x", "offset"] = 8.0 * rows["prior_sigma"]
    residuals = clean.residuals.copy()
    residuals[["residual_x", "residual_y"]] *= 2.0
    flawed = replace(clean, calibration=rows, residuals=residuals)
    assert find_causes(diagnose(flawed)).found[0].test.subject == "noise"
    by_hand = flawed.settings.with_(prior_widths={"pitch_x": 1e-3})
    found = find_causes(diagnose(replace(flawed, settings=by_hand))).found
    assert [one.test.subject for one in found] == ["prior"]


def test_walk_has_no_prior_of_its_values(clean):
    walk = clean.calibration.iloc[:3].assign(group="drift_walk_x", offset=100.0, prior_sigma=0.01)
    together = pd.concat([clean.calibration, walk], ignore_index=True)
    assert "drift_walk_x" not in {
        one.group for one in prior_rms(replace(clean, calibration=together))
    }
