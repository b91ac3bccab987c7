"""The result of a fit, from the estimate of an engine."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import pandas as pd

from solver.data.instrument import Instrument
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Mode
from solver.engines.no_solution import likely_cause
from solver.errors import NoSolutionError
from solver.problem.problem import Problem
from solver.results.eigenmode_tables import eigenmode_tables
from solver.results.summary import known_numbers, summarise, truth_summary
from solver.results.tables import (
    SolvedProblem,
    calibration_table,
    exposure_table,
    loss_table,
    residual_table,
    solved_problem,
    source_table,
    trace_table,
    true_places,
)
from solver.runtime.threads import one_blas_thread


class PartialResult(NamedTuple):
    """A result without its eigenmodes, and what they are computed from.

    They take as long as a step to other settings, and most figures do without them.
    """

    result: FitResult
    solution: SolvedProblem
    instrument: Instrument

    def eigenmodes(self) -> dict[str, pd.DataFrame]:
        """Return `EIGENMODES`, `MODE_PARAMETERS`, `MODE_SHIFTS` of `eigenmode_schema` by name."""
        return eigenmode_tables(self.solution, self.result.calibration, self.instrument)

    def whole(self) -> FitResult:
        """Return the result with its eigenmodes."""
        start = time.perf_counter()
        tables, seconds = self.eigenmodes(), dict(self.result.summary["seconds"])
        seconds["diagnose"] += time.perf_counter() - start
        return replace(self.result, **tables, summary={**self.result.summary, "seconds": seconds})


class Beginnings(NamedTuple):
    """When the work on a result and when its engine began, by `time.perf_counter`, s."""

    work: float
    engine: float


@one_blas_thread()
def partial_result(
    data: OrbitData,
    instrument: Instrument,
    settings: FitSettings,
    problem: Problem,
    estimate: Estimate,
    began: Beginnings,
) -> PartialResult:
    """Return the result of an estimate, but for its eigenmodes.

    Parameters
    ----------
    data, problem : of the orbit under `settings`
    instrument : nominal focal plane
    began : for the times in the summary

    Raises
    ------
    NoSolutionError
        If no solution with uncertainties exists; the message gives the reason.
    """
    mode = estimate.mode
    if mode.reduced is None:
        raise _no_solution(problem, mode, settings)
    solved = time.perf_counter()
    solution = solved_problem(problem, estimate, mode.reduced)
    with ThreadPoolExecutor(1) as helper:
        # The tables of the measurements are the largest.
        residuals = helper.submit(residual_table, solution, data.measurements)
        exposures = helper.submit(exposure_table, solution)
        sources, places = source_table(solution), true_places(solution, data.truth)
        numbers = summarise(solution, settings)
        tables = {
            "sources": sources,
            "residuals": residuals.result(),
            "calibration": calibration_table(solution, instrument),
            "exposures": exposures.result(),
            "trace": trace_table(mode),
            "true_places": places,
            "losses": loss_table(estimate.losses),
        }
    seconds = {
        "prepare": began.engine - began.work,
        "fit": solved - began.engine,
        "diagnose": time.perf_counter() - solved,
    }
    of_catalogue = {"n_reference_excluded": _n_reference_excluded(data, settings)}
    summary = {**numbers, **of_catalogue, "seconds": seconds, **estimate.entries}
    if places is not None:
        summary["truth"] = truth_summary(sources, places)
    result = FitResult(
        **tables,
        summary=summary,
        settings=settings,
        provenance=dict(data.provenance),
        instrument=instrument,
    )
    return PartialResult(result, solution, instrument)


def _no_solution(problem: Problem, mode: Mode, settings: FitSettings) -> NoSolutionError:
    """Return the error of a fit that ended where no uncertainties exist."""
    summary, cause = known_numbers(problem, mode, settings), likely_cause(problem, mode)
    message = f"orbit {summary['orbit']}: {mode.status.value}. {cause.sentence()}"
    return NoSolutionError(message, summary, mode.equations.gradient.chi2, cause)


def _n_reference_excluded(data: OrbitData, settings: FitSettings) -> int:
    """Return how many measured reference stars the settings exclude by their ids."""
    catalogue = data.catalogue
    is_reference = catalogue["is_reference"].to_numpy(bool)
    excluded = catalogue["source_id"].isin(settings.exclusions.sources).to_numpy()
    return int((is_reference & excluded).sum())
