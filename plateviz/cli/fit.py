"""`plateviz fit`: read an orbit, solve it with one engine or all of them, write and print."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from plateviz.cache import keep_compilations
from plateviz.cli.output import print_agreement, print_fit, print_json, print_orders
from plateviz.solving.origin import OrbitFiles
from plateviz.solving.progress import Reporter, reporting
from plateviz.verdict.no_solution import no_solution_summary
from plateviz.verdict.verdict import with_verdict
from solver.data.settings import COUNTED, ENGINES, FitSettings
from solver.errors import DistrustError, FitError, InputError, NoSolutionError
from solver.io.outputs import FITS_SUFFIXES, check_output
from solver.runtime.memory import keep_memory

if TYPE_CHECKING:
    from solver.data.orbit import OrbitData
    from solver.data.result import FitResult
    from solver.fit import OrbitFitter
    from solver.results.agreement import Agreement


class FitRequest(NamedTuple):
    """Arguments of `plateviz fit`."""

    files: OrbitFiles
    orbit: int | None
    settings: FitSettings
    engines: tuple[str, ...]
    output: Path
    checkpoint: Path | None
    overwrite: bool
    accept: bool

    def checkpoint_of(self, engine: str) -> Path | None:
        """Return the file from which a fit by an engine resumes; None for all but svi."""
        return self.checkpoint if engine == "svi" else None


class _Fitted(NamedTuple):
    """The fit by one engine.

    Attributes
    ----------
    result : as it is written
    summary : of the result, with the times, the output and the comparison of orders
    output : file of the result
    """

    result: "FitResult"
    summary: dict[str, Any]
    output: Path


def run_fit(request: FitRequest, as_json: bool) -> None:
    """Fit, write and print.

    Raises
    ------
    InputError
        If an input or an output is not as expected.
    FitError
        If a fit has no solution or has not converged, or the engines disagree.
    DistrustError
        If a solution should not be trusted, unless the request accepts that.
    """
    start = time.perf_counter()
    keep_memory()
    outputs = _checked_outputs(request)
    fits: dict[str, _Fitted] = {}
    try:
        with reporting("reading the orbit") as reporter:
            focal_plane, data = request.files.read_instrument(), request.files.read(request.orbit)
            read = time.perf_counter() - start
            reporter.say("loading the solver")
            keep_compilations()
            from solver.fit import OrbitFitter

            fitter = OrbitFitter(data, focal_plane)
            for engine, output in outputs.items():
                result = with_verdict(_fit(fitter, data, request, engine, reporter))
                reporter.say("writing the result")
                seconds = {"read": read, **dict(result.summary["seconds"])}
                seconds["write"] = _write(result, output, request, engine)
                summary = {**result.summary, "seconds": seconds, "output": str(output)}
                fits[engine] = _Fitted(result, summary | _orders(result), output)
    except NoSolutionError as error:
        if as_json:
            failed = no_solution_summary(error, request.settings)
            _print_json({**_summaries(fits), failed["engine"]: failed}, [])
        raise
    _report(fits, as_json)
    if not request.accept:
        _require_trust(fits)


def _checked_outputs(request: FitRequest) -> dict[str, Path]:
    """Return engine -> result file; `InputError` if one of the outputs cannot be written."""
    outputs = {engine: _output(request, engine) for engine in request.engines}
    inputs = request.files.inputs()
    for output in outputs.values():
        check_output(output, FITS_SUFFIXES, inputs, request.overwrite)
    if request.checkpoint is not None:
        # One that exists is resumed from.
        check_output(request.checkpoint, (), [*inputs, *outputs.values()], overwrite=True)
        if "svi" not in request.engines:
            raise InputError(
                f"--checkpoint: expected the engine svi, found {', '.join(request.engines)}"
            )
    return outputs


def _output(request: FitRequest, engine: str) -> Path:
    """Return the result file of an engine: `request.output`, with the name of a later engine."""
    output = request.output
    if engine == request.engines[0]:
        return output
    return output.with_name(f"{output.stem}-{engine}{output.suffix}")


def _fit(
    fitter: "OrbitFitter",
    data: "OrbitData",
    request: FitRequest,
    engine: str,
    reporter: Reporter,
) -> "FitResult":
    # The comparison of orders does not depend on the engine.
    compared = request.settings.compare_orders and engine == request.engines[0]
    settings = request.settings.with_(engine=engine, compare_orders=compared)
    resumption, checkpoint = None, request.checkpoint_of(engine)
    if checkpoint is not None:
        from solver.engines.checkpoint import resume_from

        instrument = request.files.read_instrument()
        resumption = resume_from(checkpoint, data, instrument, settings)
    return fitter.fit(
        settings, lambda it: reporter.say(f"{engine}: {COUNTED[engine]} {it.iteration}"), resumption
    )


def _write(result: "FitResult", output: Path, request: FitRequest, engine: str) -> float:
    """Write a result, which makes the checkpoint needless; return the time it took, s."""
    from solver.io.result import write_result

    begin = time.perf_counter()
    write_result(result, output, request.overwrite)
    checkpoint = request.checkpoint_of(engine)
    if checkpoint is not None:
        checkpoint.unlink(missing_ok=True)
    return time.perf_counter() - begin


def _orders(result: "FitResult") -> dict[str, Any]:
    """Return the summary's entries on the comparison of orders; empty if none was made."""
    from plateviz.tables.orders import order_comparison, order_verdict

    table = order_comparison(result)
    if table.empty:
        return {}
    # JSON has no NaN.
    plain = table.astype(object).where(table.notna(), None)
    return {"orders": plain.to_dict("records"), "preferred_order": order_verdict(table)}


def _report(fits: Mapping[str, _Fitted], as_json: bool) -> None:
    """Print the fits; `FitError` if one has not converged, or if they disagree."""
    rows = _agreement(fits)
    if as_json:
        _print_json(_summaries(fits), rows)
    else:
        _print_text(fits, rows)
    _require_convergence(fits)
    _require_agreement(rows)


def _agreement(fits: Mapping[str, _Fitted]) -> "list[Agreement]":
    """Return how the engines compare with the first one; no rows for a single engine."""
    if len(fits) == 1:
        return []
    from solver.results.agreement import compare_engines

    return compare_engines({engine: fit.result for engine, fit in fits.items()})


def _summaries(fits: Mapping[str, _Fitted]) -> dict[str, dict[str, Any]]:
    return {engine: fit.summary for engine, fit in fits.items()}


def _print_json(summaries: Mapping[str, dict[str, Any]], rows: "list[Agreement]") -> None:
    """Print the summary of the first engine, and all of them if there are several."""
    agreement = [{**row._asdict(), "agrees": row.agrees} for row in rows]
    more = {"engines": summaries, "agreement": agreement} if len(summaries) > 1 else {}
    print_json({**next(iter(summaries.values())), **more})


def _print_text(fits: Mapping[str, _Fitted], rows: "list[Agreement]") -> None:
    for fit in fits.values():
        print_fit(fit.summary, fit.output)
        if "orders" in fit.summary:
            print_orders(fit.summary["orders"], fit.summary["preferred_order"])
    print_agreement(rows)


def _require_convergence(fits: Mapping[str, _Fitted]) -> None:
    for summary in (fit.summary for fit in fits.values()):
        if not summary["converged"]:
            raise FitError(
                f"orbit {summary['orbit']} has not converged with {summary['engine']}: "
                f"{summary['reason']}"
            )


def _require_agreement(rows: "list[Agreement]") -> None:
    disagreements = [f"{row.engine}, {row.what}: {row.found:.3g}" for row in rows if not row.agrees]
    if disagreements:
        raise FitError(f"the engines {', '.join(ENGINES)} do not agree: {'; '.join(disagreements)}")


def _require_trust(fits: Mapping[str, _Fitted]) -> None:
    for engine, fit in fits.items():
        if fit.summary["verdict"]["state"] == "bad":
            raise DistrustError(
                f"orbit {fit.summary['orbit']}, {engine}: the fit converged, but its solution "
                "should not be trusted as it is; it is written, and --accept ends with exit code 0"
            )
