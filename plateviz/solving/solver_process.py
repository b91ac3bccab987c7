"""The solver process: reads requests from standard input, writes events to standard output.

Each line is one JSON object. This is the only process of a plateviz server that imports JAX. It
keeps its compilations between fits, and ends when its standard input ends or by SIGTERM; what it
has not finished is removed. An unexpected exception ends it with a traceback on standard error;
`plateviz.solving.solver_queue` reports that and starts another process.

Requests: {"do": "fit", "job", "origin", "orbit", "settings", "what_if", "directory", "base"},
{"do": "get ready", "job", "origin", "orbit", "base"}: for what-ifs, {"do": "simulate", "job",
"directory", "settings", "catalogue"}, {"do": "survey", "job", "directory", "run", "settings",
"orbits", "workers"}, {"do": "cancel", "job"}, and without events {"do": "prepare", "origin",
"orbit", "settings", "base", "may_fit", "only_fit", "likely", "is_urgent"}: while idle, make the
likely what-ifs of a solution, each {"settings", "directory"}, and with "may_fit" fit what they
start from, with "only_fit" no more, {"do": "pause", "seconds"}: let that wait, or a long fit for a
moment, {"do": "rest"}: give it up, and {"do": "complete", "part"} with the rest of a "fit" that is
done: write a part that its result lacks, `VERDICT` or `EIGENMODES` of
`plateviz.runs.scratch_result`. "base" is the solution of a run from which the what-ifs of the orbit
can start, {"settings", "directory"}, or None.
Events: {"event": "ready"}, and with "job": "progress", "done", "failed", "cancelled".
"""

import json
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, TextIO

from plateviz.cache import keep_compilations
from plateviz.runs.scratch_result import (
    VERDICT,
    are_eigenmodes_written,
    is_verdict_written,
    is_written,
    read_scratch_result,
    write_eigenmodes,
)
from plateviz.solving.fitters import Base, Fitters, Request, base_of, base_settings
from plateviz.solving.forecast import is_long
from plateviz.solving.preparation import Preparation, get_ready, prepare
from plateviz.solving.put_off import PutOff, judge
from plateviz.solving.survey_jobs import fit_run, simulate
from plateviz.solving.waiting_moments import WaitingMoments
from solver.data.eigenmode_schema import EIGENMODE_TABLES
from solver.data.settings import COUNTED, ENGINES, FitSettings
from solver.engines.gauss_newton import Iteration
from solver.errors import CancelledError, FitError, InputError
from solver.fit import OrbitFitter
from solver.results.orbit_result import PartialResult
from solver.runtime.interruption import interruptible
from solver.runtime.memory import keep_memory
from solver.runtime.termination import EXIT_CODE, ending_on_sigterm

Send = Callable[[dict], None]
# Idle seconds before the verdict is begun. In these the server sends the solution, a browser draws
# it, and the next request of a hand on a slider comes. On two cores, the figures would wait for it.
_NEXT_S = 0.4
# Idle seconds after that before speculative work starts. Where it shares the cores with a browser
# that draws the verdict, this would take a third longer.
_IDLE_S = 1.0
# Time in which the process removes what it has not finished, once its server has ended.
_END_S = 3.0


class _Kept(NamedTuple):
    """What the process keeps between requests."""

    fitters: Fitters
    put_off: PutOff


class _Cancellations:
    """Ids of the jobs to be cancelled."""

    def __init__(self) -> None:
        self._jobs: set[str] = set()

    def add(self, job: str) -> None:
        self._jobs.add(job)

    def check(self, job: str) -> None:
        if job in self._jobs:
            raise CancelledError(job)


class _Heard(NamedTuple):
    """What the thread that reads requests tells the one that works, at once."""

    cancellations: _Cancellations
    moments: WaitingMoments


def main() -> None:
    """Serve requests until standard input ends."""
    try:
        with ending_on_sigterm():
            _serve_all()
    except SystemExit:
        # The interpreter would wait for the thread that reads standard input.
        os._exit(EXIT_CODE)


def _serve_all() -> None:
    keep_memory()
    keep_compilations()
    send = _sender()
    requests: queue.Queue[Request | None] = queue.Queue()
    heard = _Heard(_Cancellations(), WaitingMoments())
    threading.Thread(target=_read, args=(sys.stdin, requests, heard), daemon=True).start()
    send({"event": "ready"})
    preparation = Preparation()
    kept = _Kept(Fitters(), PutOff())
    while (request := _next_request(requests, preparation, kept.put_off)) is not None:
        if request["do"] == "complete":
            _complete(request, kept)
        elif request["do"] == "prepare":
            preparation = prepare(kept.fitters, request, requests, kept.put_off)
        elif request["do"] == "pause":
            preparation = preparation.paused(request["seconds"])
        elif request["do"] == "rest":
            preparation = Preparation()
        else:
            preparation = _serve(request, send, heard, kept)


def _next_request(
    requests: queue.Queue[Request | None], preparation: Preparation, put_off: PutOff
) -> Request | None:
    """Wait for a request; do what was put off, and prepare others, once the process is idle."""
    put_off.limit()

    def check() -> None:
        if not requests.empty():
            raise CancelledError("a request waits")

    # A request that waits is sent once the one before is done, and a page that has received a
    # solution may send one, too.
    for seconds, work, steps in (
        (0.0 if preparation.is_urgent else _NEXT_S, put_off.finish_verdicts, iter(())),
        (preparation.pause, lambda: None, preparation.soon),
        (_IDLE_S, put_off.finish, preparation.later),
    ):
        try:
            return requests.get(timeout=seconds)
        except queue.Empty:
            with interruptible(check), suppress(CancelledError):
                work()
                for _ in steps:
                    check()
    return requests.get()


def _sender() -> Send:
    """Reserve standard output for events; redirect the prints of libraries to standard error."""
    channel = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    lock = threading.Lock()

    def send(event: dict) -> None:
        with lock:
            channel.write(json.dumps(event) + "\n")

    return send


def _read(lines: TextIO, requests: "queue.Queue[Request | None]", heard: _Heard) -> None:
    for line in lines:
        _hear(json.loads(line), requests, heard)
    # The server has ended: stop, even during a fit.
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_END_S)
    os._exit(EXIT_CODE)


def _hear(request: Request, requests: "queue.Queue[Request | None]", heard: _Heard) -> None:
    if request["do"] == "cancel":
        heard.cancellations.add(request["job"])
        return
    if request["do"] == "pause":
        heard.moments.ask()
    requests.put(request)


def _serve(request: Request, send: Send, heard: _Heard, kept: _Kept) -> Preparation:
    job, is_patient = request["job"], request["do"] == "fit" and is_long(request)
    work = _WORK[request["do"]]

    def check() -> None:
        heard.cancellations.check(job)

    def give_way() -> None:
        if is_patient:
            heard.moments.wait(check)

    def progress(**values: object) -> None:
        check()
        send({"event": "progress", "job": job, **values})
        give_way()

    try:
        check()
        with interruptible(give_way):
            preparation = work(request, progress, kept)
        send({"event": "done", "job": job})
        return preparation
    except CancelledError:
        send({"event": "cancelled", "job": job})
    except (InputError, FitError) as error:
        is_input = isinstance(error, InputError)
        send({"event": "failed", "job": job, "message": str(error), "is_input_error": is_input})
    return Preparation()


def _fit(request: Request, progress: Callable[..., None], kept: _Kept) -> Preparation:
    if request["what_if"] and is_written(Path(request["directory"])):
        # It was likely to be asked for.
        return Preparation()
    progress(stage="reading the orbit")
    fitter, put_off = kept.fitters.of(request), kept.put_off
    settings = FitSettings.from_dict(request["settings"])

    def on_iteration(iteration: Iteration) -> None:
        progress(stage=f"{COUNTED[settings.engine]} {iteration.iteration}", **iteration._asdict())

    def beside(iteration: Iteration) -> None:
        progress(stage=f"{COUNTED[ENGINES[0]]} {iteration.iteration}")

    progress(stage="linearising")
    found = _what_if(fitter, request, on_iteration) if request["what_if"] else None
    if found is None:
        # A fit may take long, and a page waits for the verdict.
        put_off.finish_verdicts()
    result = found.result if found else fitter.fit(settings, on_iteration, beside=beside)
    progress(stage="writing the result")
    directory = Path(request["directory"])
    put_off.write(directory, result, is_partial=found is not None)
    if found is not None:
        put_off.add_eigenmodes(lambda: write_eigenmodes(directory, found.eigenmodes()))
    return Preparation(later=fitter.precompute(settings.order))


def _what_if(
    fitter: OrbitFitter, request: Request, progress: Callable[[Iteration], None]
) -> PartialResult | None:
    """Return a solution by a step from a fit, or None if it needs a fit of its own.

    A fit from which it and those that follow can start takes no longer than its own.
    """
    settings = FitSettings.from_dict(request["settings"])
    found = fitter.partial_what_if(settings)
    if found is not None:
        return found
    base = base_of(request)
    if base is None and settings.exclusions:
        base = Base(base_settings(settings), None)
    if base is None or fitter.fitted_settings == base.settings:
        return None
    try:
        fitter.prepare_what_ifs(base.settings, progress, base.solution)
    except FitError:
        return None
    return fitter.partial_what_if(settings)


def _complete(request: Request, kept: _Kept) -> None:
    """Write a part that a result lacks: it was given up, or put off by a process that died."""
    directory, settings = Path(request["directory"]), FitSettings.from_dict(request["settings"])
    # Nobody waits for an error: who waits for such a part sees in the end that it is missing.
    with suppress(InputError, FitError):
        if request["part"] == VERDICT:
            kept.put_off.finish_verdict(directory)
            if not is_verdict_written(directory):
                judge(directory, read_scratch_result(directory, lambda _: False))
            return
        kept.put_off.finish()
        if not are_eigenmodes_written(directory):
            fitter = kept.fitters.of(request)
            found = _what_if(fitter, request, lambda _: None)
            result = fitter.fit(settings) if found is None else found.whole()
            tables = {table.name: getattr(result, table.name) for table in EIGENMODE_TABLES}
            write_eigenmodes(directory, tables)


_WORK = {
    "fit": _fit,
    "get ready": lambda request, _, kept: get_ready(kept.fitters, request),
    "simulate": lambda request, progress, _: simulate(request, progress),
    "survey": lambda request, progress, _: fit_run(request, progress),
}


if __name__ == "__main__":
    main()
