"""What a fit adjusts before its solution: moves of detectors, outliers, and the noise."""

from collections.abc import Callable
from dataclasses import replace

from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration
from solver.engines.moves import find_moves
from solver.engines.noise import estimate_noise
from solver.engines.robust import find_outliers, outlier_table, with_robust_weights
from solver.problem.adjustments import UNADJUSTED, Adjustments
from solver.problem.problem_cache import ProblemCache

# Searches of outliers, each with the noise of what the last one has left. Few measurements are near
# the limit after the second one.
_MAX_SEARCHES = 6


def find_adjustments(
    cache: ProblemCache,
    instrument: Instrument,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> Adjustments:
    """Return what the settings ask the fit to adjust, each found with those before it.

    Raises
    ------
    InputError
        If the settings exclude data that do not exist, or need more data than there are.
    """
    found = UNADJUSTED
    data, problem = cache.get(settings)
    if settings.detector_motion:
        # Before the outliers, for which all measurements of a detector that has moved would be
        # taken; these have little weight meanwhile.
        searched = with_robust_weights(problem, settings, progress) if settings.robust else problem
        found = found._replace(moves=find_moves(searched, instrument, settings, progress))
        data, problem = cache.get(settings, found)
    if settings.robust:
        return _without_outliers(cache, settings, found, progress)
    if settings.has_noise_model:
        found = found._replace(noise=estimate_noise(problem, settings, progress))
    return found


def _without_outliers(
    cache: ProblemCache,
    settings: FitSettings,
    moved: Adjustments,
    progress: Callable[[Iteration], None],
) -> Adjustments:
    """Return the outliers and the noise of the other measurements, which follow from each other.

    Parameters
    ----------
    moved : adjustments that do not depend on either
    """
    found = moved
    for _ in range(_MAX_SEARCHES):
        before = () if found.outliers is None else set(found.outliers.index)
        data, scaled = cache.get(settings, moved._replace(noise=found.noise))
        outliers = outlier_table(find_outliers(scaled, settings, progress), scaled, data)
        found = moved._replace(outliers=outliers, noise=found.noise)
        is_last = outliers is None or set(outliers.index) == before
        if is_last or not settings.has_noise_model:
            break
        _, whole = cache.get(settings, moved)
        _, problem = cache.get(settings, moved._replace(outliers=outliers))
        noise = estimate_noise(problem, settings, progress, whole)
        found = found._replace(noise=noise)
        if noise is None:
            break
    return found


def with_adjustments(result: FitResult, found: Adjustments) -> FitResult:
    """Return a result with what was adjusted in its summary.

    Outliers among what a what-if excludes are not its own.
    """
    summary, outliers = dict(result.summary), result.outliers
    if found.outliers is not None:
        outliers = found.outliers[~result.settings.exclusions.holds(found.outliers)]
        outliers = outliers.reset_index(drop=True)
        summary["n_outliers"] = len(outliers)
    if found.moves:
        summary["detector_moves"] = [move._asdict() for move in found.moves]
    if found.noise is not None:
        summary["noise"] = found.noise.entry
    return replace(result, summary=summary, outliers=outliers)
