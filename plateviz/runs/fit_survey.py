"""Fit the orbits of a survey with Dask workers, and compute the tables over all orbits.

Workers are processes on this machine or those of a Dask scheduler; all must have access to the
survey's directory. Each has one thread. An orbit's directory is either complete or absent, so
that an interrupted run can be continued at any time.
"""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
from pyarrow import parquet

from plateviz.runs.changed_inputs import changed_inputs
from plateviz.runs.dask_workers import Outcome, dask_client, fit_on_workers
from plateviz.runs.fitted_orbit import read_summary
from plateviz.runs.gathered_diagnosis import write_test_tables
from plateviz.runs.gathered_history import gather_history
from plateviz.runs.new_run import begin_run, fitting_alone
from plateviz.runs.run_directory import ERRORS_FILE, MOTIONS_FILE, RunDirectory
from plateviz.runs.worker_scratch import remove_worker_scratch
from plateviz.tables.counts import orbits_are
from solver.data.settings import FitSettings
from solver.data.survey_schema import ERRORS_BY_COUNT, MOTIONS
from solver.errors import DiskError, InputError
from solver.io.atomic import write_atomically
from solver.io.disk import size_text
from solver.io.parquet import write_parquet
from solver.io.survey import orbit_ranges, read_survey_orbit, survey_orbits
from solver.io.survey_manifest import survey_changes
from solver.io.survey_problems import copied_orbits
from solver.io.table_check import refuse
from solver.model.apparent_motion import julian_year
from solver.results.time_series import errors_by_count, motion_table
from solver.runtime.threads import count_cores

# Rows of the history per batch: some 200 MB with all draws.
_ROWS_AT_ONCE = 100_000


class Progress(NamedTuple):
    """Progress of a call: orbits done, orbits to fit, and the outcome of the last one."""

    done: int
    total: int
    last: Outcome | None


class SurveyOutcome(NamedTuple):
    """Result of a call.

    Attributes
    ----------
    fitted : orbits fitted now
    kept : orbits fitted before
    failed : reasons why orbits have no solution, by orbit
    distrusted : reasons why solutions of these orbits should not be trusted, by orbit
    """

    run: RunDirectory
    fitted: list[int]
    kept: list[int]
    failed: dict[int, str]
    distrusted: dict[int, list[str]]
    seconds: float


def fit_survey(
    survey: Path,
    name: str,
    settings: FitSettings,
    orbits: list[int] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Progress], None] = lambda _: None,
    repair: bool = False,
) -> SurveyOutcome:
    """Fit the orbits of a survey that a run does not contain yet, and write the tables over all.

    Parameters
    ----------
    name : of the run
    settings : of every fit
    orbits : orbits to fit; all by default
    workers : number of processes on this machine; one per core by default
    scheduler : address of a Dask scheduler to use instead
    progress : called after every orbit
    repair : whether damaged orbits and tables are removed and made again; otherwise they are
        refused

    Raises
    ------
    DiskError
        If the disk is full or read-only; the orbits written before are kept.
    InputError
        If the survey, the run or an orbit is not there as asked for, a file of the run is
        damaged, no scheduler answers, or another process is fitting the run.
    """
    wanted = _wanted(survey, orbits)
    run = begin_run(survey, name, settings)
    with fitting_alone(run):
        # Another process may have begun a run of that name at the same time.
        begin_run(survey, name, settings)
        refuse(copied_orbits(survey))
        changed = changed_inputs(run)
        if repair:
            # An orbit that could not be fitted again is not removed.
            refuse(survey_changes(survey))
            for orbit in changed:
                read_survey_orbit(survey, orbit)
            run.remove_damaged(changed)
        else:
            refuse([*run.changes(), *changed.values()])
        return fit_missing(run, wanted, workers, scheduler, progress)


def fit_missing(
    run: RunDirectory,
    wanted: list[int],
    workers: int | None,
    scheduler: str | None,
    progress: Callable[[Progress], None],
    closes: bool = True,
) -> SurveyOutcome:
    """Fit those of some orbits that a locked run does not contain, and write the tables over all.

    Parameters
    ----------
    closes : whether the run becomes complete if no orbit of the survey is missing
    """
    start = time.perf_counter()
    run.remove_abandoned()
    remove_worker_scratch()
    there = set(run.complete_orbits())
    missing = [orbit for orbit in wanted if orbit not in there]
    failed: dict[int, str] = {}
    progress(Progress(0, len(missing), None))
    try:
        if missing:
            with dask_client(min(workers or count_cores(), len(missing)), scheduler) as client:
                for done, outcome in enumerate(fit_on_workers(client, run, missing), start=1):
                    if outcome.message:
                        failed[outcome.orbit] = outcome.message
                    progress(Progress(done, len(missing), outcome))
        gather(run)
        if closes:
            close_run(run)
    except DiskError as error:
        raise DiskError(f"{error}{_needed(run, missing)}") from error
    finally:
        # Of workers that were ended.
        run.remove_abandoned()
    fitted = [orbit for orbit in missing if orbit not in failed]
    kept = [orbit for orbit in wanted if orbit in there]
    distrusted = _distrusted(run, sorted([*fitted, *kept]))
    return SurveyOutcome(run, fitted, kept, failed, distrusted, time.perf_counter() - start)


def _distrusted(run: RunDirectory, orbits: list[int]) -> dict[int, list[str]]:
    """Return the reasons of bad verdicts, which runs of older versions do not have."""
    found = {}
    for orbit in orbits:
        verdict = read_summary(run.orbit_directory(orbit)).get("verdict")
        if verdict is not None and verdict["state"] == "bad":
            found[orbit] = [str(reason) for reason in verdict["reasons"]]
    return found


def _needed(run: RunDirectory, missing: list[int]) -> str:
    """Return how much room the orbits that are still missing need, as text."""
    complete = run.complete_orbits()
    left = sorted(set(missing) - set(complete))
    if not complete or not left:
        return ""
    files = [path for one in complete for path in run.orbit_directory(one).iterdir()]
    size = sum(path.stat().st_size for path in files) / len(complete) * len(left)
    return f"; {orbits_are(len(left))} left, for about {size_text(size)} more"


def _wanted(survey: Path, orbits: list[int] | None) -> list[int]:
    there = survey_orbits(survey)
    if orbits is None:
        return there
    absent = sorted(set(orbits) - set(there))
    if absent:
        raise InputError(
            f"{survey}: expected orbits out of {orbit_ranges(there)}, "
            f"found {', '.join(map(str, absent[:5]))}"
        )
    return sorted(set(orbits))


def close_run(run: RunDirectory) -> None:
    """Mark a run as complete if every orbit of the survey is fitted and gathered."""
    complete = run.complete_orbits()
    if not run.is_complete and complete and complete == survey_orbits(run.survey):
        run.mark_complete()


def gather(run: RunDirectory) -> None:
    """Write the tables over all orbits, unless they are there."""
    complete = run.complete_orbits()
    if run.is_complete or not complete or run.gathered_orbits() == complete:
        return
    run.begin_gathering()
    history = gather_history(run)
    write_test_tables(run)
    _write_motions(run, history)
    run.mark_gathered(complete)


def _write_motions(run: RunDirectory, path: Path) -> None:
    """Write the motions, last of all: a run with motions is read, and judged, as gathered.

    Parameters
    ----------
    path : of the gathered history
    """
    history = parquet.ParquetFile(path)
    epochs = np.unique(_column(history, "epoch"))
    epoch = float(julian_year(epochs).mean())
    motions, artificial = [], []
    for rows in _whole_sources(history):
        motions.append(motion_table(rows, epoch))
        artificial.append(rows[rows["is_artificial"] & rows["true_offset_ra"].notna()])
    averaged = pd.concat(artificial, ignore_index=True)
    most = int(averaged.groupby("source_id").size().max()) if len(averaged) else 0
    errors = errors_by_count(averaged, list(range(1, most + 1)))
    _write(run.directory / ERRORS_FILE, errors[ERRORS_BY_COUNT.names])
    _write(run.directory / MOTIONS_FILE, pd.concat(motions)[MOTIONS.names])


def _whole_sources(history: parquet.ParquetFile) -> Iterator[pd.DataFrame]:
    """Yield the history in batches that do not split a source."""
    rest: list[pa.RecordBatch] = []
    for batch in history.iter_batches(batch_size=_ROWS_AT_ONCE):
        table = pa.Table.from_batches([*rest, batch]).to_pandas()
        last = table["source_id"] == table["source_id"].iloc[-1]
        rest = pa.Table.from_pandas(table[last], preserve_index=False).to_batches()
        if not last.all():
            yield table[~last].reset_index(drop=True)
    if rest:
        yield pa.Table.from_batches(rest).to_pandas()


def _column(history: parquet.ParquetFile, name: str) -> np.ndarray:
    return history.read([name])[name].to_numpy()


def _write(path: Path, table: pd.DataFrame) -> None:
    with write_atomically(path) as temporary:
        write_parquet(pa.Table.from_pandas(table, preserve_index=False), temporary)
