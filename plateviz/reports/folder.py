"""A folder of reports: a page for each orbit of a run, and an index page of the survey."""

import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path

from plateviz.reports.page import page_of
from plateviz.reports.report import Facts, Link, Report
from plateviz.reports.survey import survey_orbit_report, survey_report
from plateviz.runs.run import Run, open_run
from solver.errors import FitError, InputError
from solver.io.atomic import sha256_of, write_atomically
from solver.io.disk import writing
from solver.io.scratch import is_scratch, remove_abandoned
from solver.runtime.versions import versions_of

_INDEX = "index.html"
# Identifies the run of the pages, so that pages of different runs are not mixed.
_HEAD = "report.json"
_PACKAGES = ("plateviz", "bokeh")


def write_folder(
    run: Run,
    folder: Path,
    facts: Facts,
    workers: int | None = None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> tuple[int, int]:
    """Write the missing pages, and the index last.

    Parameters
    ----------
    facts : provenance of the report
    workers : number of processes; None for one per core
    progress : called with the number of finished pages, and of all pages

    Returns
    -------
    The number of orbit pages written, and the number that existed.

    Raises
    ------
    FitError
        If a process that writes pages is killed.
    InputError
        If orbits of the run are missing, or the folder cannot be written or has other content.
    """
    index = survey_report(run, facts)
    orbits = run.orbits()["orbit_id"].tolist()
    _begin(run, folder)
    missing = [orbit for orbit in orbits if not _page(folder, orbit).is_file()]
    done = len(orbits) - len(missing)
    progress(done, len(orbits))
    if missing:
        count = min(workers or os.cpu_count() or 1, len(missing))
        with _workers(count, folder) as pool:
            tasks = [
                pool.submit(
                    _write, run.survey, run.name, orbit, folder, facts, _around(orbits, orbit)
                )
                for orbit in missing
            ]
            for number, task in enumerate(as_completed(tasks), start=1):
                task.result()
                progress(done + number, len(orbits))
    _write_page(folder / _INDEX, _with_links(index, orbits))
    return len(missing), done


@contextmanager
def _workers(count: int, folder: Path) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of processes; they end, and their scratch is removed, if the block raises."""
    others = set(active_children())
    # Spawned, because a forked copy of a process with threads may deadlock.
    pool = ProcessPoolExecutor(count, get_context("spawn"), initializer=_end_with_parent)
    try:
        yield pool
        pool.shutdown()
    except BrokenProcessPool as error:
        raise FitError(
            f"{folder}: expected processes that write the pages, found that one was killed; most "
            "often the memory does not suffice for so many --workers; finished pages are kept, and "
            "the same command goes on"
        ) from error
    finally:
        for process in set(active_children()) - others:
            process.terminate()
        pool.shutdown(cancel_futures=True)
        remove_abandoned(folder)


def _end_with_parent() -> None:
    """End this process when its parent ends, even if the parent is killed."""
    # The process that writes the pages decides what a Ctrl-C ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _begin(run: Run, folder: Path) -> None:
    """Create the folder, or check that its pages are of the same run."""
    head = {"run": sha256_of(run.directory / "run.toml"), "versions": versions_of(_PACKAGES)}
    path = folder / _HEAD
    remove_abandoned(folder)
    if path.is_file():
        if json.loads(path.read_text(encoding="utf-8")) != head:
            raise InputError(f"{folder}: expected pages of this run and version, found others")
        return
    with writing(folder, "to write a folder"):
        folder.mkdir(parents=True, exist_ok=True)
    if not all(is_scratch(path.name) for path in folder.iterdir()):
        raise InputError(
            f"{folder}: expected an empty folder or a folder of reports, found other files"
        )
    with write_atomically(path) as temporary:
        temporary.write_text(json.dumps(head, indent=1), encoding="utf-8")


def _write(
    survey: Path, name: str, orbit: int, folder: Path, facts: Facts, links: list[Link]
) -> None:
    """Write the page of one orbit: the task of a process."""
    # Without choices, to keep many pages small; `plateviz report --orbit` writes them.
    report = survey_orbit_report(open_run(survey, name), orbit, facts, has_choices=False)
    _write_page(_page(folder, orbit), replace(report, links=links))


def _write_page(path: Path, report: Report) -> None:
    with write_atomically(path) as temporary:
        temporary.write_text(page_of(report), encoding="utf-8", errors="replace")


def _page(folder: Path, orbit: int) -> Path:
    return folder / f"orbit-{orbit:04d}.html"


def _link(text: str, orbit: int) -> Link:
    return Link(text, _page(Path(), orbit).name)


def _around(orbits: list[int], orbit: int) -> list[Link]:
    """Return the links of an orbit's page to the index and to the neighbouring orbits."""
    place = orbits.index(orbit)
    links = [Link("Survey", _INDEX)]
    links += [_link(f"← Orbit {number}", number) for number in orbits[:place][-1:]]
    return links + [_link(f"Orbit {number} →", number) for number in orbits[place + 1 :][:1]]


def _with_links(index: Report, orbits: list[int]) -> Report:
    """Return the survey's report with links from its table of orbits to their pages."""
    table = index.tables["Orbits"]
    first = table.columns[0]
    linked = table.assign(**{first: [_link(str(orbit), orbit) for orbit in orbits]})
    return replace(index, tables={**index.tables, "Orbits": linked})
