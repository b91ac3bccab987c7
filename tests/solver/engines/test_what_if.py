from dataclasses import replace

import jax
import numpy as np
import pandas as pd
import pytest

from solver.data.exclusions import without_excluded
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.engines import warm_starts, what_if
from solver.errors import CancelledError, FitError
from solver.fit import OrbitFitter, fit_orbit
from solver.linear import linearised_chunks
from solver.linear.normal_equations import accumulate
from solver.linear.update import update_equations
from solver.problem.problem import build_problem
from solver.runtime.interruption import interruptible
from tests.solver.small_orbit import make_orbit

# Required agreement with a refit, in sigmas.
AGREEMENT = 1e-3


@pytest.fixture(scope="module")
def orbit():
    return make_orbit()


@pytest.fixture(scope="module")
def fitter(orbit):
    return fitted(OrbitFitter(orbit.data, orbit.instrument))


@pytest.fixture(scope="module")
def sample_fitter(sample_orbit):
    return fitted(OrbitFitter(sample_orbit))


@pytest.fixture(scope="module")
def prepared_fitter(sample_orbit):
    """A fitter with warm starts for every lower order."""
    prepared = fitted(OrbitFitter(sample_orbit))
    assert len(list(prepared.precompute(6))) > 4
    return prepared


def fitted(fitter):
    fitter.fit(FitSettings(order=6))
    return fitter


@pytest.fixture
def solved_orders(monkeypatch):
    """The lower orders that are solved during a test, in turn."""
    orders, find_mode = [], warm_starts.find_mode

    def noting(problem, settings, **options):
        orders.append(settings.order)
        return find_mode(problem, settings, **options)

    monkeypatch.setattr(warm_starts, "find_mode", noting)
    return orders


def first(data, *columns):
    return tuple(data.measurements[list(columns)].iloc[0].tolist())


# Those that take the same way through the code as another one.
SIMILAR = ("pointing-held", "distortion-held", "no-exposure")
CHANGES = {
    "nothing": lambda data: {},
    "detectors-held": lambda data: {"prior_widths": {"detector_x": 10.0, "pitch_x": 1e-3}},
    "sources-loose": lambda data: {"prior_widths": {"sources": 3.0}},
    "pointing-held": lambda data: {"prior_widths": {"pointing_ra": 600.0, "pointing_dec": 600.0}},
    "distortion-held": lambda data: {"prior_widths": {"distortion_x": 0.1}},
    "centres-shifted": lambda data: {
        "prior_shifts": {
            "detector_x": 20.0,
            "detector_y[2]": -30.0,
            "pointing_dec": 20.0,
            "pointing_ra[0/1]": -40.0,
            "focal_length": 500.0,
            "position_angle[0/2]": 5.0,
            "distortion_x[3/0]": 1.0,
            "sources[ra]": 0.4,
        }
    },
    "lower-order": lambda data: {"order": 5},
    "no-source": lambda data: {"exclusions": Subset(frozenset(first(data, "source_id")))},
    "no-exposure": lambda data: {
        "exclusions": Subset(exposures=frozenset([first(data, "field_id", "plate_id")]))
    },
    "no-detector": lambda data: {
        "exclusions": Subset(detectors=frozenset(first(data, "detector_id")))
    },
}


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.full) if name in SIMILAR else name for name in CHANGES
    ],
)
def pair(request, sample_orbit, sample_fitter):
    """The what-if and the refit of the sample orbit under changed settings."""
    settings = FitSettings(**{"order": 6, **CHANGES[request.param](sample_orbit)})
    return sample_fitter.what_if(settings), fit_orbit(sample_orbit, settings=settings)


@pytest.mark.slow
def test_refit_confirms_the_positions_and_their_uncertainties(pair):
    found, expected = pair
    assert found.summary["reason"] == FitStatus.WHAT_IF.value
    assert list(found.sources["source_id"]) == list(expected.sources["source_id"])
    for axis in ("ra", "dec"):
        sigma = expected.sources[f"sigma_{axis}_marginal"]
        moved = found.sources[f"offset_{axis}"] - expected.sources[f"offset_{axis}"]
        assert np.abs(moved / sigma).max() < AGREEMENT
        for kind in ("marginal", "conditional"):
            column = f"sigma_{axis}_{kind}"
            np.testing.assert_allclose(
                found.sources[column], expected.sources[column], rtol=AGREEMENT
            )


@pytest.mark.slow
def test_refit_confirms_the_diagnostics(pair):
    found, expected = pair
    for axis in "xy":
        column = f"standardised_{axis}"
        np.testing.assert_allclose(
            found.residuals[column], expected.residuals[column], atol=5e-3, rtol=2e-3
        )
    for key in ("chi2_per_dof", "effective_parameters", "mean_error_ra", "normalised_deviation_ra"):
        assert found.summary[key] == pytest.approx(expected.summary[key], rel=1e-3)
    assert list(found.calibration["label"]) == list(expected.calibration["label"])


@pytest.mark.parametrize(
    "settings",
    [FitSettings(order=7), FitSettings(order=6, aberration=False)],
    ids=["higher-order", "other-model"],
)
def test_change_beyond_the_fit_needs_a_refit(fitter, settings):
    assert fitter.what_if(settings) is None


PREPARED = {
    "lower-order": lambda data: {"order": 5},
    "lower-order-held": lambda data: {"order": 5, "prior_widths": {"detector_x": 10.0}},
}


@pytest.mark.slow
@pytest.mark.parametrize("change", PREPARED)
def test_precomputed_order_is_not_linearised_again(
    change, sample_orbit, sample_fitter, prepared_fitter, monkeypatch
):
    settings = FitSettings(**{"order": 6, **PREPARED[change](sample_orbit)})
    expected = sample_fitter.what_if(settings)

    def refuse(*_):
        raise AssertionError("linearised again")

    monkeypatch.setattr("solver.linear.update.accumulate", refuse)
    found = prepared_fitter.what_if(settings)
    step = found.sources["offset_ra"] - expected.sources["offset_ra"]
    assert np.abs(step / expected.sources["sigma_ra_marginal"]).max() < 1e-3
    for name in ("sigma_dec_marginal", "chi2"):
        np.testing.assert_allclose(found.sources[name], expected.sources[name], rtol=1e-3)


def test_interrupted_precomputation_resumes_and_runs_once(orbit):
    prepared = fitted(OrbitFitter(orbit.data, orbit.instrument))
    next(prepared.precompute(6))
    rest = len(list(prepared.precompute(6)))
    assert rest > 0
    assert list(prepared.precompute(6)) == []


def test_request_need_not_wait_for_a_step_of_the_precomputation(orbit):
    """The step is interrupted between two chunks of measurements, and done later."""
    prepared, checks = fitted(OrbitFitter(orbit.data, orbit.instrument)), []

    def refuse():
        checks.append(1)
        raise CancelledError("a request waits")

    steps = prepared.precompute(6)
    with interruptible(refuse):
        for _ in range(3):
            next(steps)
    assert len(checks) == 3
    whole = fitted(OrbitFitter(orbit.data, orbit.instrument))
    assert len(list(steps)) == len(list(whole.precompute(6)))
    settings = FitSettings(order=5, prior_widths={"sources": 3.0})
    found, expected = prepared.what_if(settings), whole.what_if(settings)
    pd.testing.assert_frame_equal(found.sources, expected.sources)


@pytest.mark.full
def test_what_ifs_with_fewer_measurements_have_nothing_to_compile(sample_orbit, monkeypatch):
    """JAX compiles once for each shape of the chunks."""
    fitter, shapes = OrbitFitter(sample_orbit), set()
    fitter.fit(FitSettings(order=2))
    linearise = linearised_chunks.linearise

    def noting(*arguments):
        shapes.add(arguments[-1].shape)
        return linearise(*arguments)

    monkeypatch.setattr(linearised_chunks, "linearise", noting)
    list(fitter.precompute(2))
    compiled = shapes.copy()
    shapes.clear()
    ids = np.unique(sample_orbit.measurements["source_id"]).tolist()
    for excluded in (
        {"sources": frozenset(ids[:1])},
        {"sources": frozenset(ids[::20])},
        {"exposures": frozenset([first(sample_orbit, "field_id", "plate_id")])},
    ):
        settings = FitSettings(order=2, exclusions=Subset(**excluded))
        assert fitter.what_if(settings) is not None
    assert len(shapes) > 1
    assert shapes <= compiled


def test_lower_order_without_a_shifted_term_is_not_precomputed(orbit):
    fitter = OrbitFitter(orbit.data, orbit.instrument)
    settings = FitSettings(order=2, prior_shifts={"distortion_x[2/0]": 1.0})
    fitter.fit(settings)
    list(fitter.precompute(2))
    assert fitter.what_if(settings) is not None


@pytest.mark.slow
def test_every_lower_order_is_precomputed(sample_orbit, prepared_fitter):
    variants = [FitSettings(order=order) for order in (4, 1)]
    for settings in variants:
        found = prepared_fitter.what_if(settings)
        expected = fit_orbit(sample_orbit, settings=settings)
        moved = found.sources["offset_ra"] - expected.sources["offset_ra"]
        assert np.abs(moved / expected.sources["sigma_ra_marginal"]).max() < AGREEMENT
        assert found.summary["chi2"] == pytest.approx(expected.summary["chi2"], rel=1e-6)


def test_lower_order_compiles_nothing(orbit, caplog):
    def compiled(order):
        caplog.clear()
        with jax.log_compiles():
            fitter.fit(FitSettings(order=order))
        return [record.args[0] for record in caplog.records if "Compiling" in record.msg]

    fitter = OrbitFitter(orbit.data, orbit.instrument)
    jax.clear_caches()
    assert any("derivatives" in name for name in compiled(5))
    assert compiled(3) == compiled(0) == []


def test_what_ifs_start_from_a_fit_without_a_result(orbit, fitter):
    prepared = OrbitFitter(orbit.data, orbit.instrument)
    prepared.prepare_what_ifs(FitSettings(order=6))
    settings = FitSettings(order=6, prior_widths={"sources": 3.0})
    found, expected = prepared.what_if(settings), fitter.what_if(settings)
    pd.testing.assert_frame_equal(found.sources, expected.sources)


def test_fit_that_does_not_converge_is_no_start(orbit):
    fitter = OrbitFitter(orbit.data, orbit.instrument)
    with pytest.raises(FitError, match="orbit 7: the limit of iterations"):
        fitter.prepare_what_ifs(FitSettings(max_iterations=1))
    assert fitter.fitted_settings is None


def test_unfitted_orbit_needs_a_fit(orbit):
    assert OrbitFitter(orbit.data, orbit.instrument).what_if(FitSettings()) is None


def test_lower_order_is_solved_once(orbit, solved_orders):
    """Dropping the fifth order of the distortion moves the sources too far for a step."""
    fitter = fitted(OrbitFitter(orbit.data, orbit.instrument))
    for width in (1.0, 1.1):
        settings = FitSettings(order=4, prior_widths={"sources": width})
        found = fitter.what_if(settings)
        expected = fit_orbit(orbit.data, orbit.instrument, settings)
        moved = found.sources["offset_ra"] - expected.sources["offset_ra"]
        assert (moved.abs() < AGREEMENT * expected.sources["sigma_ra_marginal"]).all()
        assert found.summary["reason"] == FitStatus.WHAT_IF.value
    assert solved_orders == [4]
    # The fit is still there, for what-ifs of its own order.
    assert fitter.fitted_settings.order == 6
    assert fitter.what_if(FitSettings(order=6, prior_widths={"sources": 2.0})) is not None


def test_lower_order_is_solved_with_the_priors_that_are_asked_for(orbit, solved_orders):
    """A long step from the fit's own priors left the calibration up to 0.3 sigma off."""
    fitter = fitted(OrbitFitter(orbit.data, orbit.instrument))
    settings = FitSettings(order=4, prior_widths={"sources": 9.0})
    found = fitter.what_if(settings)
    assert found.trace["largest_step"].max() < 1.0
    expected = fit_orbit(orbit.data, orbit.instrument, settings).calibration
    moved = (found.calibration["offset"] - expected["offset"]).abs()
    # Coefficients that are fixed have no uncertainty.
    assert (moved <= 0.05 * expected["sigma_marginal"]).all()
    assert solved_orders == [4]


def test_lower_order_without_some_measurements_is_a_start_for_what_has_all(orbit, solved_orders):
    fitter = fitted(OrbitFitter(orbit.data, orbit.instrument))
    without = Subset(frozenset(first(orbit.data, "source_id")))
    assert fitter.what_if(FitSettings(order=5, exclusions=without)) is not None
    found = fitter.what_if(FitSettings(order=5))
    assert found.summary["reason"] == FitStatus.WHAT_IF.value
    assert solved_orders == [5]


def test_change_too_large_for_a_linear_model_is_solved_by_iterations(orbit, fitter, monkeypatch):
    monkeypatch.setattr(warm_starts, "solve_what_if", lambda *_: None)
    settings = FitSettings(order=6, prior_widths={"sources": 2.0})
    found, expected = fitter.what_if(settings), fit_orbit(orbit.data, orbit.instrument, settings)
    assert found.summary["reason"] == FitStatus.CONVERGED.value
    moved = found.sources["offset_ra"] - expected.sources["offset_ra"]
    assert (moved.abs() < AGREEMENT * expected.sources["sigma_ra_marginal"]).all()


def test_change_that_iterations_do_not_solve_needs_a_refit(fitter, monkeypatch):
    monkeypatch.setattr(warm_starts, "solve_what_if", lambda *_: None)
    settings = FitSettings(order=6, prior_widths={"sources": 2.0}, max_iterations=1, tolerance=1e-9)
    assert fitter.what_if(settings) is None


@pytest.mark.parametrize(
    ("steps", "is_solved"),
    [
        ((0.7, 1e-4), True),
        # Directions kept fixed in the second step follow in the third.
        ((0.7, 1.5e-3, 8e-3, 1e-5), True),
        ((0.7, 0.1, 0.05, 1e-4), True),
        ((24.0, 1e-4), True),
        ((26.0, 1e-4), False),
        ((0.7, 0.8), False),
        ((0.7, 1.5e-3, 0.8), False),
        ((0.7, 1.5e-3, 8e-3, 9e-3), False),
        ((0.7, 0.6, 0.5, 0.4, 0.3, 1e-4), False),
    ],
)
def test_steps_of_a_nearly_linear_model_become_shorter(fitter, monkeypatch, steps, is_solved):
    """A solution is returned once a step is below the tolerance."""
    remaining = iter(steps)
    monkeypatch.setattr(what_if, "largest_step", lambda *_: (next(remaining), "detector x [0]"))
    found = fitter.what_if(FitSettings(order=6, prior_widths={"sources": 3.0}))
    assert (found.summary["reason"] == FitStatus.WHAT_IF.value) == is_solved


def test_what_if_starts_from_the_fit_not_from_another_what_if(fitter):
    before = fitter.what_if(FitSettings(order=6))
    fitter.what_if(FitSettings(order=6, prior_widths={"sources": 3.0}))
    after = fitter.what_if(FitSettings(order=6))
    np.testing.assert_array_equal(before.sources["ra"], after.sources["ra"])


EXCLUSIONS = {
    "a-detector": lambda data: Subset(detectors=frozenset(first(data, "detector_id"))),
    "detectors": lambda data: Subset(
        detectors=frozenset(data.measurements["detector_id"].unique().tolist()[:2])
    ),
    "a-source": lambda data: Subset(frozenset(first(data, "source_id"))),
    "an-exposure": lambda data: Subset(exposures=frozenset([first(data, "field_id", "plate_id")])),
    "detector-and-source": lambda data: Subset(
        frozenset(first(data, "source_id")), detectors=frozenset(first(data, "detector_id"))
    ),
}


@pytest.mark.parametrize("name", EXCLUSIONS)
def test_blocks_without_some_measurements_equal_those_of_the_others(
    name, orbit, problem, expansion_point
):
    """Blocks are sums over the measurements, so removing some subtracts their contribution."""
    equations = accumulate(problem, *expansion_point)
    fewer = without(EXCLUSIONS[name](orbit.data), orbit)
    compare_blocks(update_equations(equations, problem, fewer), fewer)


def test_blocks_without_a_detector_need_no_linearisation(
    orbit, problem, expansion_point, monkeypatch
):
    equations = accumulate(problem, *expansion_point)
    monkeypatch.setattr("solver.linear.contribution.accumulate", None)
    for name in ("a-detector", "detectors"):
        fewer = without(EXCLUSIONS[name](orbit.data), orbit)
        assert update_equations(equations, problem, fewer) is not None


def test_blocks_without_a_detector_that_overlaps_another_are_correct(orbit):
    """Where detectors overlap, both measure a source in one exposure."""
    table = orbit.data.measurements
    others = table[table["detector_id"] != first(orbit.data, "detector_id")[0]].head(50)
    twice = others.assign(detector_id=first(orbit.data, "detector_id")[0])
    table = pd.concat([table, twice], ignore_index=True)
    both = orbit._replace(data=replace(orbit.data, measurements=table))
    problem = build_problem(both.data, orbit.instrument, FitSettings())
    origin = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    equations = accumulate(problem, *origin)
    fewer = without(EXCLUSIONS["a-detector"](orbit.data), both)
    compare_blocks(update_equations(equations, problem, fewer), fewer)


@pytest.mark.parametrize("name", [None, "a-detector"])
def test_blocks_of_a_lower_order_equal_those_accumulated_for_it(
    name, orbit, problem, expansion_point
):
    """This includes blocks between the distortion terms, taken from the higher order."""
    settings = FitSettings(order=problem.order - 1, prior_shifts={"detector_x": 1.0})
    exclusions = EXCLUSIONS[name](orbit.data) if name else Subset()
    lower = without(exclusions, orbit, settings)
    compare_blocks(update_equations(accumulate(problem, *expansion_point), problem, lower), lower)


def test_blocks_between_the_terms_of_a_lower_order_are_reused(
    orbit, problem, expansion_point, monkeypatch
):
    equations = accumulate(problem, *expansion_point)
    monkeypatch.setattr("solver.linear.normal_equations._add_coefficients", None)
    lower = without(Subset(), orbit, FitSettings(order=problem.order - 1))
    assert update_equations(equations, problem, lower) is not None


def without(exclusions, orbit, settings=None):
    return build_problem(
        without_excluded(orbit.data, exclusions), orbit.instrument, settings or FitSettings()
    )


def compare_blocks(found, problem):
    expected = accumulate(problem, *found.at)
    for name in ("theta", "source", "cross"):
        values = getattr(expected, name)
        np.testing.assert_allclose(getattr(found, name), values, atol=1e-9 * np.abs(values).max())
    for block, values in zip(found.gradient, expected.gradient, strict=True):
        np.testing.assert_allclose(block, values, rtol=1e-6, atol=1e-6 * np.abs(values).max())


def test_update_refuses_other_measurements(problem, expansion_point):
    measurements = replace(problem.measurements, label=problem.measurements.label + 1)
    fewer = replace(problem, measurements=measurements)
    assert update_equations(accumulate(problem, *expansion_point), problem, fewer) is None
