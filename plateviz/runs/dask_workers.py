"""The Dask workers of a survey: how they are started, and the task that fits one orbit."""

import logging
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from typing import NamedTuple

import dask.config
from distributed import Client, Future, KilledWorker, LocalCluster, as_completed

from plateviz.cache import keep_compilations
from plateviz.runs.run_directory import RunDirectory
from plateviz.runs.worker_scratch import worker_scratch
from plateviz.verdict.verdict import orbit_verdict, with_verdict
from solver.data.result import FitResult
from solver.errors import DiskError, FitError, InputError
from solver.io.disk import disk_error
from solver.io.survey import read_survey_instrument, read_survey_orbit
from solver.runtime.memory import keep_memory
from solver.runtime.threads import use_one_thread

# Dask's monitoring samples each worker a hundred times a second. With as many workers as cores
# this took a twelfth of the processor time.
_LESS_MONITORING = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
}
# Timeout of the connection to a scheduler.
_TIMEOUT = "20s"


class Outcome(NamedTuple):
    """Outcome of one orbit; `message` is the reason if it failed, otherwise empty."""

    orbit: int
    seconds: float
    message: str


def fit_survey_orbit(survey: str, name: str, orbit: int) -> Outcome:
    """Fit one orbit of a run whose directory exists, and write it into the run.

    An orbit without a solution is recorded as failed; every other error is raised, and so is
    that of a full disk, which all orbits share.
    """
    start = time.perf_counter()
    run, message = RunDirectory(Path(survey), name), ""
    keep_memory()
    keep_compilations()
    use_one_thread()
    try:
        _fit(run, orbit)
    except DiskError:
        raise
    except (InputError, FitError) as error:
        message = str(error)
        run.keep_failure(orbit, message)
    return Outcome(orbit, time.perf_counter() - start, message)


def _fit(run: RunDirectory, orbit: int) -> None:
    # Imported here, because JAX sets its number of threads when it is imported.
    from solver.fit import OrbitFitter

    instrument = read_survey_instrument(run.survey)
    fitter = OrbitFitter(read_survey_orbit(run.survey, orbit), instrument)
    result = with_verdict(fitter.fit(run.settings()))
    try:
        tables = {"history": fitter.history(result), **fitter.sky_statistics(result)}
    except FitError as error:
        raise FitError(_with_cause(str(error), result)) from error
    run.keep(orbit, result, tables)


def _with_cause(reason: str, result: FitResult) -> str:
    """Return why an orbit has no solution, and what to do where the verdict knows the cause."""
    causes = orbit_verdict(result).causes
    # What the residuals look like before the last step is no more than a hint.
    if not causes or causes[0].name == "not-converged":
        return reason
    title, options = causes[0].title, f" ({' '.join(causes[0].options)})"
    said = f"{title[0].upper()}{title[1:]}: {causes[0].action}"
    return f"{reason}. {said}{options if causes[0].options else ''}"


@contextmanager
def dask_client(workers: int, scheduler: str | None) -> Iterator[Client]:
    """Give a client of a scheduler, or of workers that are started here and ended afterwards.

    Parameters
    ----------
    workers : number of processes to start if no scheduler is given
    scheduler : address of a Dask scheduler that has workers of its own, or None

    Raises
    ------
    InputError
        If no scheduler answers at that address.
    """
    if scheduler is not None:
        # A scheduler that is lost is told in words, not by a traceback of each attempt.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        try:
            client = Client(scheduler, timeout=_TIMEOUT)
        except (OSError, ValueError) as error:
            raise InputError(
                f"--scheduler: expected the address of a Dask scheduler, found {scheduler}: {error}"
            ) from error
        with client:
            yield client
        return
    with ExitStack() as stack:
        scratch = stack.enter_context(worker_scratch())
        temporary = {"temporary-directory": str(scratch.path)}
        stack.enter_context(dask.config.set({**_LESS_MONITORING, **temporary}))
        with _interrupted_later():
            cluster = stack.enter_context(_local_cluster(workers))
        yield stack.enter_context(Client(cluster))


def _local_cluster(workers: int) -> LocalCluster:
    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        # No dashboard; its server still needs a port, so any free one is taken.
        dashboard_address="127.0.0.1:0",
        scheduler_kwargs={"dashboard": False},
        # No memory limit per worker.
        memory_limit=0,
        # No warnings about workers that are slow to end.
        silence_logs=logging.ERROR,
    )


@contextmanager
def _interrupted_later() -> Iterator[None]:
    """Let Ctrl-C in the block act at its end, and not at all on processes that it starts.

    Distributed cannot end a cluster whose workers are starting, and a terminal sends Ctrl-C to
    them, too.
    """
    if threading.current_thread() is not threading.main_thread():
        # Ctrl-C acts on the main thread only.
        yield
        return
    interrupts: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: interrupts.append(number))
    try:
        with _blocked_for_new_processes():
            yield
    finally:
        signal.signal(signal.SIGINT, before)
        if interrupts:
            signal.raise_signal(signal.SIGINT)


@contextmanager
def _blocked_for_new_processes() -> Iterator[None]:
    """Let processes that are started in the block inherit that Ctrl-C does nothing."""
    if sys.platform == "win32":
        yield
        return
    # Where it is started later, it takes the signal up again before the first worker starts.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def fit_on_workers(client: Client, run: RunDirectory, orbits: list[int]) -> Iterator[Outcome]:
    """Fit orbits, and yield the outcome of each when it is done.

    Raises
    ------
    DiskError
        If an orbit cannot be written because the disk is full or read-only.
    FitError
        If the scheduler is lost.
    """
    where = str(run.survey.resolve())
    futures: dict[Future, int] = {
        client.submit(fit_survey_orbit, where, run.name, orbit, pure=False): orbit
        for orbit in orbits
    }
    for future in as_completed(futures):
        if future.cancelled():
            raise FitError(
                f"{run.directory}: expected the Dask scheduler until all orbits are fitted, found "
                "that the connection to it was lost; finished orbits are kept, and the same "
                "command goes on"
            )
        error = future.exception()
        if error is None:
            yield future.result()
            continue
        orbit = futures[future]
        message = _reason(error, run, orbit)
        run.keep_failure(orbit, message)
        yield Outcome(orbit, float("nan"), message)


def _reason(error: BaseException, run: RunDirectory, orbit: int) -> str:
    """Return why an orbit failed; raise the errors that all orbits share."""
    if isinstance(error, DiskError):
        raise error
    if (full := disk_error(error, run.orbit_directory(orbit))) is not None:
        raise full from error
    if isinstance(error, KilledWorker):
        return (
            f"orbit {orbit}: expected a worker process that fits it, found that each of the "
            f"{error.allowed_failures + 1} that tried was killed; most often the memory does not "
            "suffice for so many --workers"
        )
    # An unexpected error must not stop the other orbits.
    return f"{type(error).__name__}: {error}"
