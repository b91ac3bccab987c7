"""Noise model: by how much the errors differ from those stated, by restricted likelihood.

The logarithm of the variance of a measurement is that of its stated variance plus a linear
predictor: of its exposure, powers of its star's magnitude, both or neither. A floor may be added in
quadrature (`solver.engines.variance_model`). The logarithm of the reference stars' catalogue
variance has one addition for all. Where the restricted likelihood is largest, the squared residuals
that go with each parameter sum to their expectation, which leverage lowers; scoring steps get there
in a few fits.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration, Mode, StartingPoint, find_mode
from solver.engines.variance_model import VarianceModel
from solver.errors import InputError
from solver.linear.covariances import Covariances, covariances
from solver.linear.leverage import residuals
from solver.problem.noise import Noise
from solver.problem.problem import Problem

_MAX_ROUNDS = 20
# Degree of the logarithm of the variance as a polynomial in the magnitude.
_MAGNITUDE_DEGREE = 3
# A step that is this fraction of its uncertainty ends the search.
_TOLERANCE = 0.05
# Largest step of the logarithm of the references' variance.
_MAX_STEP = 1.0
# Prior of the logarithm of the references' variance, about the stated one: Student's t. The data of
# one orbit may hardly say anything about it, and would then make it vanish. Where they say much,
# the tails of the prior leave the estimate to them.
_REFERENCE_WIDTH, _REFERENCE_DOF = 1.0, 4.0


class _Parameters(NamedTuple):
    """A value for each parameter of the noise model, or its uncertainty.

    Attributes
    ----------
    of_rows : those of `VarianceModel`, shape (parameters,)
    of_references : logarithm of the references' variance over the stated one
    """

    of_rows: Float[np.ndarray, " parameter"]
    of_references: float


class _Round(NamedTuple):
    """The search for the noise model after a number of fits.

    Attributes
    ----------
    number : of fits
    start : where the next fit starts, the solution of the last one; None before the first
    is_solution : whether the last fit has found its solution
    at : values of the parameters, after the step that follows from that fit
    sigma : their uncertainties
    largest : step over its uncertainty, of the parameter where that is largest
    """

    number: int
    start: StartingPoint | None
    is_solution: bool
    at: _Parameters
    sigma: _Parameters
    largest: float

    @property
    def has_converged(self) -> bool:
        """Whether the last step was small."""
        return bool(self.largest < _TOLERANCE)


def estimate_noise(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
    whole: Problem | None = None,
) -> Noise | None:
    """Estimate the noise model that the settings ask for.

    Parameters
    ----------
    whole : problem with the outliers, which get uncertainties, too; None if there are none

    Returns
    -------
    None if a fit on the way has no solution; the fit that follows reports the reason

    Raises
    ------
    InputError
        If the noise is to depend on magnitudes and there are none.
    """
    model_of_all = _variance_model(whole or problem, settings)
    labels = pd.Index((whole or problem).measurements.label)
    model_of_all, model = model_of_all.of_rows(labels.get_indexer(problem.measurements.label))
    found = _search(problem, settings, model, progress)
    if found is None:
        return None
    by_row, by_reference = found.at
    factor = pd.Series(model_of_all.factor(by_row), index=labels)
    entry = _entry(found, model, settings)
    return Noise(factor, model.floor(by_row), float(np.exp(0.5 * by_reference)), entry)


def _search(
    problem: Problem,
    settings: FitSettings,
    model: VarianceModel,
    progress: Callable[[Iteration], None],
) -> _Round | None:
    """Return the last round of scoring steps, or None without a solution."""
    start = _Parameters(model.start(), 0.0)
    last = _Round(0, None, False, start, start, np.inf)
    # Wrong uncertainties may be what keeps a fit from its solution.
    while not (last.is_solution and last.has_converged) and last.number < _MAX_ROUNDS:
        following = _next_round(last, problem, settings, model, progress)
        if following is None:
            return None
        last = following
    return last if last.is_solution else None


def _next_round(
    last: _Round,
    problem: Problem,
    settings: FitSettings,
    model: VarianceModel,
    progress: Callable[[Iteration], None],
) -> _Round | None:
    """Fit with the noise of the last round, and take a step; None if that fit is impossible."""
    by_row, by_reference = last.at
    scaled = _scaled(problem, model.sigma(by_row), np.exp(0.5 * by_reference))
    mode = find_mode(scaled, settings, progress, start=last.start)
    if mode.reduced is None:
        return None
    covariance = covariances(mode.reduced)
    found = residuals(scaled, mode.theta, mode.sources, covariance)
    step, sigma = model.step(by_row, found)
    reference_step, reference_sigma = 0.0, np.inf
    if settings.reference_scale:
        reference_step, reference_sigma = _step_of_references(
            scaled, mode, covariance, by_reference
        )
    at = _Parameters(by_row + step, by_reference + reference_step)
    largest = np.max(np.abs(step) / sigma, initial=abs(reference_step) / reference_sigma)
    return _Round(
        number=last.number + 1,
        start=StartingPoint(mode.theta, mode.sources),
        is_solution=mode.status.is_solution,
        at=at,
        sigma=_Parameters(sigma, reference_sigma),
        largest=largest,
    )


def _entry(found: _Round, model: VarianceModel, settings: FitSettings) -> dict[str, object]:
    """Return what the summary of a result says about the noise.

    Factors are logarithms of those on the uncertainties, half of those on the variances.
    """
    log_factor, sigma = (
        _by_name(values, model.names, settings) for values in (found.at, found.sigma)
    )
    entry: dict[str, object] = {
        "rounds": found.number,
        "converged": found.has_converged,
        "log_factor": log_factor,
        "sigma": sigma,
    }
    if model.has_floor:
        entry["floor_pix"] = model.floor(found.at.of_rows)
        entry["floor_sigma_pix"] = model.floor_sigma(found.at.of_rows, found.sigma.of_rows)
    return entry


def _by_name(values: _Parameters, names: Sequence[str], settings: FitSettings) -> dict[str, float]:
    """Return half of each value by the name of its parameter, without that of the floor."""
    # The floor is last, and has no name.
    pairs = zip(names, values.of_rows, strict=False)
    halves = {name: 0.5 * float(value) for name, value in pairs}
    if settings.reference_scale:
        halves["references"] = 0.5 * values.of_references
    return halves


def _variance_model(problem: Problem, settings: FitSettings) -> VarianceModel:
    """Return the model of the variances that the settings ask for."""
    index, n_obs = problem.measurements.index, problem.n_obs
    names: list[str] = []
    columns: list[np.ndarray] = [np.empty((n_obs, 0))]
    if settings.noise_by_exposure:
        names += [f"exposure {one.name}" for one in problem.elements["exp"]]
        columns.append(np.eye(problem.layout.n_exp)[index.exposure])
    elif settings.noise_scale or settings.noise_by_magnitude:
        names.append("all")
        columns.append(np.ones((n_obs, 1)))
    if settings.noise_by_magnitude:
        magnitude = _magnitude(problem)[index.source]
        centred = np.nan_to_num(magnitude - np.nanmean(magnitude))
        powers = _powers_of(magnitude)
        names += ["per magnitude" if k == 1 else f"per magnitude^{k}" for k in powers]
        columns += [centred[:, None] ** k for k in powers]
    stated, design = problem.measurements.sigma, np.concatenate(columns, axis=1)
    return VarianceModel(names, design, stated, settings.noise_floor)


def _magnitude(problem: Problem) -> Float[np.ndarray, " src"]:
    if "magnitude" in problem.sources and problem.sources["magnitude"].notna().any():
        return problem.sources["magnitude"].to_numpy(dtype=np.float64)
    raise InputError("noise by magnitude: expected a column magnitude in the catalogue, found none")


def _powers_of(magnitude: Float[np.ndarray, " obs"]) -> range:
    """Return the powers of the magnitude that the logarithm of the variance may have."""
    distinct = len(np.unique(magnitude[np.isfinite(magnitude)]))
    return range(1, min(_MAGNITUDE_DEGREE, max(distinct - 1, 1)) + 1)


def _scaled(problem: Problem, sigma: Float[np.ndarray, "obs 2"], reference: float) -> Problem:
    """Return the problem with other uncertainties of the measurements and reference stars."""
    is_reference = problem.sources["is_reference"].to_numpy(bool)
    precision = problem.priors.precision / np.where(is_reference, reference**2, 1.0)[:, None, None]
    return replace(
        problem,
        measurements=replace(problem.measurements, sigma=sigma),
        priors=problem.priors._replace(precision=precision),
    )


def _step_of_references(
    problem: Problem, mode: Mode, covariance: Covariances, now: float
) -> tuple[float, float]:
    """Return a scoring step of the logarithm of the references' variance, and its uncertainty.

    Parameters
    ----------
    now : its logarithm over the stated one
    """
    chosen = problem.sources["is_reference"].to_numpy(bool)
    precision, offset = problem.priors.precision[chosen], mode.sources[chosen]
    squares = float(np.einsum("si,sij,sj->", offset, precision, offset))
    # What the measurements moved: the identity where they alone decide.
    moved = np.eye(2) - precision @ covariance.source[chosen]
    expected = float(np.trace(moved, axis1=1, axis2=2).sum())
    tail = _REFERENCE_DOF * _REFERENCE_WIDTH**2
    of_prior = (_REFERENCE_DOF + 1.0) * now / (tail + now**2)
    information = 0.5 * float(np.einsum("sij,sji->", moved, moved))
    # What the prior says where it is most certain, which keeps the steps small.
    information += (_REFERENCE_DOF + 1.0) / tail
    step = (0.5 * (squares - expected) - of_prior) / information
    return float(np.clip(step, -_MAX_STEP, _MAX_STEP)), information**-0.5
