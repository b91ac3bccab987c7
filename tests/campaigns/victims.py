"""What the campaign of kills kills: commands with a measured duration, and what they leave."""

import hashlib
import multiprocessing
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, field
from functools import partial
from http.client import HTTPException
from pathlib import Path

import dask.config

# What the commands import, so that a copy of this process has it.
import plateviz.runs.fit_survey  # noqa: F401
import solver.simulate.survey  # noqa: F401
from plateviz.cli.main import main
from plateviz.plots.gallery import diagnostics, survey_figures
from plateviz.reports import folder
from plateviz.reports import orbit as orbit_pages
from plateviz.reports import survey as survey_pages
from plateviz.runs.run_directory import RunDirectory, run_directories
from plateviz.solving.job import JobStatus
from plateviz.solving.origin import SurveyFolder
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.solver_queue import SolverQueue
from solver.data.settings import FitSettings
from solver.io.scratch import is_scratch
from solver.io.survey_header import HEADER
from solver.io.survey_manifest import survey_changes
from solver.runtime.termination import ending_on_sigterm
from tests.campaigns.forked import Forked, run_and_exit

REPOSITORY = Path(__file__).resolve().parents[2]
ORBITS, STARS, SEED = 3, 2500, 3
# Time in which every process of a trial that was killed must be gone.
ORPHAN_SECONDS = 10.0
_PATIENCE_SECONDS = 240.0
_STAMP = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC")

Files = dict[str, str]
Process = subprocess.Popen | Forked


@dataclass
class Place:
    """Folders of one trial, or of an undisturbed command: where it works, and its scratch."""

    folder: Path
    base: Path
    is_forked: bool = True
    orphan_seconds: float = ORPHAN_SECONDS

    def __post_init__(self) -> None:
        end(self)
        shutil.rmtree(self.folder, ignore_errors=True)
        self.scratch.mkdir(parents=True)

    @property
    def scratch(self) -> Path:
        """The folder for temporary files of its processes."""
        return self.folder / "tmp"

    @property
    def work(self) -> Path:
        """The survey, or the folder of pages, that its command writes."""
        return self.folder / "work"

    def start(self, *arguments: object) -> Process:
        """Start a plateviz command in a session of its own."""
        if self.is_forked:
            return self.fork(partial(_run_command, list(map(str, arguments))))
        # In a file, because a process that outlives the command would keep a pipe open.
        with (self.folder / "printed").open("wb") as printed:
            return subprocess.Popen(
                [sys.executable, "-m", "plateviz.cli.main", *map(str, arguments)],
                cwd=self.folder,
                env={**os.environ, **self._environment()},
                stdout=printed,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def fork(self, work: Callable[[], None]) -> "Forked":
        """Start work in a copy of this process, which has imported what it needs."""
        (self.folder / "printed").unlink(missing_ok=True)
        pid = os.fork()
        if pid:
            return Forked(pid)
        os.setsid()
        os.chdir(self.folder)
        os.environ.update(self._environment())
        tempfile.tempdir = None
        file = os.open("printed", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        for descriptor in (1, 2):
            os.dup2(file, descriptor)
        run_and_exit(work)
        raise AssertionError("expected the copy to have ended")

    def _environment(self) -> dict[str, str]:
        return {
            "TMPDIR": str(self.scratch),
            "PYTHONPATH": str(REPOSITORY),
            "PYTHONUNBUFFERED": "1",
        }

    def printed(self) -> str:
        """Return what the last command has printed."""
        path = self.folder / "printed"
        return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""

    def processes(self) -> list[int]:
        """Return the ids of all processes that run in this place."""
        return [pid for pid in _all_processes() if _runs_in(pid, self.folder)]

    def outliving(self) -> list[str]:
        """Return the commands of all processes that run in this place."""
        return [_command(pid)[:200] for pid in self.processes()]

    def leftovers(self) -> list[str]:
        """Return all scratch folders, and those of Dask's workers, that are there."""
        paths = self.folder.rglob("*")
        dask = "dask-scratch-space"
        return [
            str(path.relative_to(self.folder))
            for path in paths
            if is_scratch(path.name) or (dask in path.parent.name and "worker" in path.name)
        ]


class Victim:
    """A command to be killed; `kill` picks the processes by a trial's random numbers."""

    name = ""
    ways = ("process", "group")
    # Whether all trials run the command in a copy of this process.
    is_costly = False

    def prepare(self, place: Place) -> None:
        """Put in place what the command needs."""

    def start(self, place: Place) -> Process:
        """Start the command."""
        raise AssertionError(self.name)

    def has_begun(self, place: Place) -> bool:
        """Return whether the command has begun to write."""
        return place.work.is_dir() and any(place.work.iterdir())

    def is_done(self, process: Process, place: Place) -> bool:
        """Return whether the command has done its work, or has ended without."""
        return process.poll() is not None

    def go_on(self, process: Process, place: Place) -> None:
        """Do what a user does after a child of the command was killed."""

    def stop(self, process: Process) -> int:
        """Wait for the command, which is done, to end; return its exit code."""
        return process.wait(_PATIENCE_SECONDS)

    def is_complete(self, place: Place) -> bool:
        """Return whether the command was so far that it refuses to run again."""
        return False

    def finished(self, place: Place) -> Files:
        """Return the SHA-256 of every file that is finished, and must not change any more."""
        return {}

    def result(self, place: Place) -> Files:
        """Return the SHA-256 of all that the finished command leaves, without times."""
        return {}

    def faults(self, place: Place) -> list[str]:
        """Return what is wrong with the files as the kill left them."""
        return []


class Simulate(Victim):
    """`plateviz simulate`."""

    name = "simulate"

    def start(self, place: Place) -> Process:
        return place.start("simulate", "work", "--orbits", ORBITS, "--stars", STARS, "--seed", SEED)

    def is_complete(self, place: Place) -> bool:
        return (place.work / HEADER).is_file()

    def finished(self, place: Place) -> Files:
        return digests(place.work, lambda path: path.suffix == ".parquet")

    def result(self, place: Place) -> Files:
        return digests(place.work)

    def faults(self, place: Place) -> list[str]:
        return survey_changes(place.work) if (place.work / HEADER).is_file() else []


@dataclass
class Survey(Victim):
    """`plateviz survey` by a number of workers, of which one may be killed."""

    workers: int
    ways: tuple[str, ...] = field(default=("process", "group", "worker"))

    @property
    def name(self) -> str:
        return f"survey, {self.workers} worker{'s' if self.workers > 1 else ''}"

    def prepare(self, place: Place) -> None:
        shutil.copytree(place.base / "survey", place.work)

    def has_begun(self, place: Place) -> bool:
        return place.work.joinpath("runs", "default", "run.toml").is_file()

    def start(self, place: Place) -> Process:
        return place.start("survey", "work", "--workers", self.workers)

    def finished(self, place: Place) -> Files:
        orbits = RunDirectory(place.work, "default").complete_orbits()
        names = {f"orbit={orbit:04d}" for orbit in orbits}
        return digests(place.work, lambda path: "runs" not in path.parts or path.parts[2] in names)

    def result(self, place: Place) -> Files:
        return digests(place.work, lambda path: path.name != "timings.json")

    def faults(self, place: Place) -> list[str]:
        return survey_changes(place.work) + [
            change for run in run_directories(place.work) for change in run.changes()
        ]


@dataclass
class Report(Victim):
    """`plateviz report --pages`."""

    name: str = "report folder"
    is_costly = True
    ways: tuple[str, ...] = field(default=("process", "group", "worker"))

    def start(self, place: Place) -> Process:
        survey = place.base / "fitted"
        return place.start("report", survey, "--pages", "-o", "work", "--workers", 2)

    def finished(self, place: Place) -> Files:
        # The index is written again with the time of the call.
        return digests(place.work, lambda path: path.name.startswith("orbit-"))

    def result(self, place: Place) -> Files:
        return digests(place.work, without=_STAMP)


@dataclass
class Server(Victim):
    """The web process of a dashboard or its solver process, while two fits are asked for."""

    name: str = "web process"
    ways: tuple[str, ...] = field(default=("process", "group"))

    def prepare(self, place: Place) -> None:
        shutil.copytree(place.base / "survey", place.work)

    def has_begun(self, place: Place) -> bool:
        return bool(self._address(place))

    def start(self, place: Place) -> Process:
        if place.is_forked:
            return place.fork(_serve_without_pages)
        process = place.start("serve", "work", "--no-open", "--port", 0)
        threading.Thread(target=self.go_on, args=(process, place), daemon=True).start()
        return process

    def go_on(self, process: Process, place: Place) -> None:
        """Open the pages of two orbits, which asks for their fits."""
        if place.is_forked:
            process.send_signal(signal.SIGUSR1)
            return
        while process.poll() is None and not self._address(place):
            time.sleep(0.05)
        for orbit in range(2):
            # The server may be killed while it answers.
            with suppress(OSError, HTTPException):
                page = f"{self._address(place)}?orbit={orbit}"
                urllib.request.urlopen(page, timeout=60).read()

    def is_done(self, process: Process, place: Place) -> bool:
        marks = list(place.scratch.glob("plateviz-*.part/orbit=*/result.json"))
        # Before it has begun, they are those of the server that was killed.
        is_served = self.has_begun(place) and len(marks) >= 2
        return is_served or process.poll() is not None

    def stop(self, process: Process) -> int:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
        code = process.wait(_PATIENCE_SECONDS)
        return 0 if code == 128 + signal.SIGTERM else code or 1

    def finished(self, place: Place) -> Files:
        return digests(place.work)

    def result(self, place: Place) -> Files:
        """Of the solutions in the scratch folder of the server that runs."""
        folders = list(place.scratch.glob("plateviz-*.part"))
        wanted = [digests(folder, _is_of_solution) for folder in folders]
        return wanted[0] if len(wanted) == 1 else {}

    def _address(self, place: Place) -> str:
        found = re.search(r"http://\S+", place.printed())
        return found[0] if found else ""


def _serve_without_pages() -> None:
    """Keep a store as the server does, and ask for two fits; after SIGUSR1 again if they fail."""
    with ending_on_sigterm(), closing(SolutionStore(SurveyFolder("work"), SolverQueue())) as store:
        sys.stdout.write("serves on http://nowhere\n")
        sys.stdout.flush()
        again: list[int] = []
        signal.signal(signal.SIGUSR1, lambda number, _: again.append(number))
        jobs = [store.request(orbit, FitSettings()) for orbit in range(2)]
        while True:
            time.sleep(0.05)
            if again and any(job.status is JobStatus.FAILED for job in jobs):
                jobs = [store.request(orbit, FitSettings()) for orbit in range(2)]


def _run_command(arguments: list[str]) -> None:
    sys.argv = ["main.py", *arguments]
    # Workers are copies, too, so that they need not import all again.
    fork = multiprocessing.get_context("fork")
    folder.get_context = lambda _: fork
    # Two figures of a page prove as much as all of them.
    some, others = diagnostics()[:2], survey_figures()[:2]
    orbit_pages.diagnostics, survey_pages.survey_figures = lambda: some, lambda: others
    with dask.config.set({"distributed.worker.multiprocessing-method": "fork"}):
        main()


def _is_of_solution(path: Path) -> bool:
    return path.parts[0].startswith("orbit=") and path.name != "timings.json"


VICTIMS: dict[str, Victim] = {
    victim.name: victim
    for victim in (
        Simulate(),
        Survey(1),
        Survey(2),
        Report(),
        Server("solver process", ways=("solver",)),
        Server(),
    )
}


def digests(
    folder: Path,
    wanted: Callable[[Path], bool] = lambda _: True,
    without: re.Pattern[bytes] | None = None,
) -> Files:
    """Return the SHA-256 of files by their path in a folder; scratch folders are left out.

    Parameters
    ----------
    wanted : whether a path, relative to the folder, is wanted
    without : what is left out of the files' contents
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if path.is_file() and not any(map(is_scratch, name.parts)) and wanted(name):
            content = path.read_bytes()
            content = without.sub(b"", content) if without else content
            found[name.as_posix()] = hashlib.sha256(content).hexdigest()
    return found


def kill(process: Process, place: Place, way: str, number: int, choice: float) -> bool:
    """Send a signal to the process, its group, or a child; whether there was one to send it to."""
    if process.poll() is not None:
        return False
    if way == "group":
        os.killpg(process.pid, number)
        return True
    if way == "process":
        process.send_signal(number)
        return True
    children = [pid for pid in place.processes() if _is_child(pid, process.pid, way)]
    if not children:
        return False
    victim = children[int(choice * len(children))]
    try:
        os.kill(victim, number)
    except ProcessLookupError:
        return False
    return True


def end(place: Place) -> None:
    """Kill all processes of a place that are left."""
    for pid in place.processes():
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue


def _all_processes() -> Iterator[int]:
    for path in Path("/proc").iterdir():
        if path.name.isdigit() and int(path.name) != os.getpid():
            yield int(path.name)


def _runs_in(pid: int, folder: Path) -> bool:
    try:
        return os.readlink(f"/proc/{pid}/cwd") == str(folder)
    except OSError:
        return False


def _is_child(pid: int, parent: int, way: str) -> bool:
    command = _command(pid)
    if way == "solver":
        return "solver_process" in command
    return pid != parent and "solver_process" not in command and "resource_tracker" not in command


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""
