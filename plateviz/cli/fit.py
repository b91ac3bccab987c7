"""`plateviz fit`: read an orbit, solve it with one engine or all of them, write and print."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from plateviz.cache import keep_compilations
from plateviz.cli.output import print_agreement, print_fit, print_json, print_orders
from plateviz.solving.origin import OrbitFiles
from plateviz.solving.progress import Reporter, reporting
from plateviz.verdict.verdict import with_verdict
from solver.data.settings import COUNTED, ENGINES, FitSettings
from solver.errors import DistrustError, FitError, InputError
from solver.io.outputs import FITS_SUFFIXES, check_output
from solver.runtime.memory import keep_memory

if TYPE_CHECKING:
    from solver.data.orbit import OrbitData
    from solver.data.result import FitResult
    from solver.fit import OrbitFitter


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


def run_fit(request: FitRequest, as_json: bool) -> None:
    """Fit, write and print.

    Raises
    ------
    FitError
        If a fit has not converged or the engines disagree.
    DistrustError
        If a solution should not be trusted, unless the request accepts that.
    """
    start = time.perf_counter()
    keep_memory()
    outputs = {engine: _output(request, engine) for engine in request.engines}
    inputs = request.files.inputs()
    for output in outputs.values():
        check_output(output, FITS_SUFFIXES, inputs, request.overwrite)
    if request.checkpoint is not None:
        # One that exists is resumed from.
        check_output(request.checkpoint, (), [*inputs, *outputs.values()], overwrite=True)
    if request.checkpoint is not None and "svi" not in request.engines:
        raise InputError(
            f"--checkpoint: expected the engine svi, found {', '.join(request.engines)}"
        )
    summaries, results = {}, {}
    with reporting("reading the orbit") as reporter:
        focal_plane, data = request.files.read_instrument(), request.files.read(request.orbit)
        read = time.perf_counter() - start
        reporter.say("loading the solver")
        keep_compilations()
        from solver.fit import OrbitFitter
        from solver.io.result import write_result

        fitter = OrbitFitter(data, focal_plane)
        for engine, output in outputs.items():
            result = with_verdict(_fit(fitter, data, request, engine, reporter))
            reporter.say("writing the result")
            fitted = time.perf_counter()
            write_result(result, output, request.overwrite)
            if engine == "svi" and request.checkpoint is not None:
                request.checkpoint.unlink(missing_ok=True)
            seconds = {"read": read, **dict(result.summary["seconds"])}
            seconds["write"] = time.perf_counter() - fitted
            summaries[engine] = {**result.summary, "seconds": seconds, "output": str(output)}
            summaries[engine] |= _orders(result)
            results[engine] = result
    _report(summaries, results, outputs, as_json)
    if not request.accept:
        _require_trust(summaries)


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
    resumption = None
    if engine == "svi" and request.checkpoint is not None:
        from solver.engines.checkpoint import resume_from

        instrument = request.files.read_instrument()
        resumption = resume_from(request.checkpoint, data, instrument, settings)
    return fitter.fit(
        settings, lambda it: reporter.say(f"{engine}: {COUNTED[engine]} {it.iteration}"), resumption
    )


def _orders(result: "FitResult") -> dict[str, Any]:
    """Return the summary's entries on the comparison of orders; empty if none was made."""
    from plateviz.tables.orders import order_comparison, order_verdict

    table = order_comparison(result)
    if table.empty:
        return {}
    # JSON has no NaN.
    plain = table.astype(object).where(table.notna(), None)
    return {"orders": plain.to_dict("records"), "preferred_order": order_verdict(table)}


def _require_trust(summaries: Mapping[str, dict[str, Any]]) -> None:
    for engine, summary in summaries.items():
        if summary["verdict"]["state"] == "bad":
            raise DistrustError(
                f"orbit {summary['orbit']}, {engine}: the fit converged, but its solution should "
                "not be trusted as it is; it is written, and --accept ends with exit code 0"
            )


def _report(
    summaries: Mapping[str, dict[str, Any]],
    results: Mapping[str, "FitResult"],
    outputs: Mapping[str, Path],
    as_json: bool,
) -> None:
    first = next(iter(summaries.values()))
    rows = []
    if len(results) > 1:
        from solver.results.agreement import compare

        rows = compare(results)
    if as_json:
        agreement = [{**row._asdict(), "agrees": row.agrees} for row in rows]
        more = {"engines": summaries, "agreement": agreement} if rows else {}
        print_json({**first, **more})
    else:
        for engine, summary in summaries.items():
            print_fit(summary, outputs[engine])
            if "orders" in summary:
                print_orders(summary["orders"], summary["preferred_order"])
        print_agreement(rows)
    for summary in summaries.values():
        if not summary["converged"]:
            raise FitError(
                f"orbit {summary['orbit']} has not converged with {summary['engine']}: "
                f"{summary['reason']}"
            )
    disagreements = [f"{row.engine}, {row.what}: {row.found:.3g}" for row in rows if not row.agrees]
    if disagreements:
        raise FitError(f"the engines {', '.join(ENGINES)} do not agree: {'; '.join(disagreements)}")
