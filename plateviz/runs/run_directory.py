"""Runs: every orbit of a survey fitted with one choice of settings, as a directory.

    runs/NAME/run.toml                    settings, versions, hashes of the inputs; written first
    runs/NAME/orbit=0000/                 one fitted orbit (`plateviz.runs.fitted_orbit`)
    runs/NAME/failed/orbit=0000.json      why an orbit has no solution
    runs/NAME/history.parquet             all orbits sorted by source (`plateviz.runs.run`)
    runs/NAME/motions.parquet, ...        tables computed from it and from the orbits
    runs/NAME/gathered.json               the orbits in these tables, and the tables' SHA-256;
                                          removed before they are written, and written after them
    runs/NAME/COMPLETE                    written last, when every orbit of the survey is fitted: a
                                          manifest of the files that belong to no orbit

A run that `plateviz watch` began has `grows = true` in its `run.toml`: orbits are added to the
survey while it is fitted, and it becomes complete when it is closed.

No user interface and no JAX. Existing files of orbits are never changed: an interrupted run is
continued with the missing orbits, and only with the settings with which it was created.
"""

import json
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from plateviz.runs.fitted_orbit import (
    is_complete,
    orbit_changes,
    remove_fitted_orbit,
    write_fitted_orbit,
)
from solver.data.result import FitResult
from solver.data.run_schema import RUN_TABLES
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.atomic import sha256_of, write_atomically
from solver.io.disk import writing
from solver.io.failures import reading
from solver.io.manifest import changes, manifest_of, read_manifest, require_unchanged
from solver.io.scratch import remove_abandoned
from solver.io.settings import parse_settings
from solver.io.survey import survey_orbits
from solver.io.survey_header import read_header

DEFAULT_RUN = "default"
RUN_FILE = "run.toml"
# In the header of a run whose survey may grow while it is fitted.
GROWS = "grows"
_COMPLETE = "COMPLETE"
_GATHERED = "gathered.json"
_FAILED = "failed"
# The tables over all orbits.
HISTORY_FILE, MOTIONS_FILE, ERRORS_FILE = (
    "history.parquet",
    "motions.parquet",
    "errors_by_count.parquet",
)
# Those from which the run is tested.
TEST_FILES = tuple(f"{table.name}.parquet" for table in RUN_TABLES)
_TABLES = (HISTORY_FILE, MOTIONS_FILE, ERRORS_FILE, *TEST_FILES)
_REMEDY = "`plateviz survey` with --repair writes the run's tables again"
_HEADER_REMEDY = "restore it from a copy, or fit the survey with another --run"
_ORBIT = re.compile(r"orbit=(\d{4,})")

# Given a file, its SHA-256 if that is known, and a remedy; InputError if the file is another one.
Check = Callable[[Path, str | None, str], None]


class RunProgress(NamedTuple):
    """How far a run is: what of it has been written.

    Attributes
    ----------
    n_orbits : number of orbits of the survey
    n_fitted, n_failed : number of those with a solution, and of those that have none for a reason
    is_gathered : whether the tables over all orbits are there
    is_complete : whether nothing is missing
    gathered : the orbits in these tables
    grows : whether orbits may be added to the survey while the run is fitted
    """

    n_orbits: int
    n_fitted: int
    n_failed: int
    is_gathered: bool
    is_complete: bool
    gathered: tuple[int, ...] = ()
    grows: bool = False


@dataclass(frozen=True)
class RunDirectory:
    """The files of one run of a survey, which fits write; `plateviz.runs.run` reads them.

    Attributes
    ----------
    survey : the survey's directory
    name : of the run
    """

    survey: Path
    name: str

    @property
    def directory(self) -> Path:
        """The run's directory."""
        return self.survey / "runs" / self.name

    @property
    def grows(self) -> bool:
        """Whether orbits may be added to the survey while the run is fitted."""
        return read_header(self.directory, RUN_FILE, "run").get(GROWS) is True

    @property
    def is_complete(self) -> bool:
        """Whether every orbit of the survey is fitted, and the tables over all are written."""
        return (self.directory / _COMPLETE).is_file()

    @property
    def is_gathered(self) -> bool:
        """Whether the tables over all orbits are there: of all orbits or of those not failed."""
        return self.is_complete or (self.directory / MOTIONS_FILE).is_file()

    def progress(self) -> RunProgress:
        """Return what the run has now; takes a millisecond for each hundred orbits."""
        # The other way round, an orbit that is being written could be missing in a complete run.
        is_complete, is_gathered = self.is_complete, self.is_gathered
        return RunProgress(
            len(survey_orbits(self.survey)),
            len(self.complete_orbits()),
            len(self.failures()),
            is_gathered,
            is_complete,
            tuple(self.gathered_orbits()),
            self.grows,
        )

    def orbit_directory(self, orbit: int) -> Path:
        """Return the directory of a fitted orbit."""
        return self.directory / f"orbit={orbit:04d}"

    def complete_orbits(self) -> list[int]:
        """Return the fitted orbits, sorted."""
        return [one for one in self._orbits_there() if is_complete(self.orbit_directory(one))]

    def failures(self) -> dict[int, str]:
        """Return the reasons why orbits have no solution, by orbit."""
        reasons = {}
        for path in sorted((self.directory / _FAILED).glob("orbit=*.json")):
            with reading(str(path), "why an orbit has no solution"):
                content = json.loads(path.read_text(encoding="utf-8"))
                reasons[int(content["orbit"])] = str(content["message"])
        return reasons

    def settings(self) -> FitSettings:
        """Return the settings of all its fits."""
        return parse_settings(self.header().get("settings"), str(self.directory / RUN_FILE))

    def header(self) -> Mapping[str, object]:
        """Return the header of the run: `settings`, `versions`, hashes of the `inputs`."""
        self.require_unchanged(RUN_FILE)
        return read_header(self.directory, RUN_FILE, "run")

    def require_unchanged(self, name: str, check: Check = require_unchanged) -> None:
        """Refuse a file that belongs to no orbit, and is not as it was written; InputError."""
        remedy = _HEADER_REMEDY if name == RUN_FILE else _REMEDY
        check(self.directory / name, self._listed().get(name), remedy)

    def changes(self) -> list[str]:
        """Return a message for each file of the run that is not as it was written."""
        orbits = map(self.orbit_directory, self._orbits_there())
        return [*chain.from_iterable(map(orbit_changes, orbits)), *self._table_changes()]

    def remove_damaged(self, also: Collection[int] = ()) -> list[int]:
        """Remove orbits and tables over all orbits that are not as they were written.

        Parameters
        ----------
        also : orbits to be removed as well

        Returns
        -------
        The removed orbits, which have to be fitted again.
        """
        there = self._orbits_there()
        damaged = [o for o in there if o in also or orbit_changes(self.orbit_directory(o))]
        if damaged or self._table_changes():
            for name in (_COMPLETE, _GATHERED):
                (self.directory / name).unlink(missing_ok=True)
        for orbit in damaged:
            remove_fitted_orbit(self.orbit_directory(orbit))
        return damaged

    def keep(self, orbit: int, result: FitResult, tables: Mapping[str, pd.DataFrame]) -> None:
        """Write a fitted orbit with its history and other tables; remove a recorded failure."""
        write_fitted_orbit(self.orbit_directory(orbit), result, tables)
        self._failure_path(orbit).unlink(missing_ok=True)

    def keep_failure(self, orbit: int, message: str) -> None:
        """Write the reason why an orbit has no solution."""
        path = self._failure_path(orbit)
        with writing(path):
            path.parent.mkdir(exist_ok=True)
        with write_atomically(path) as temporary:
            content = json.dumps({"orbit": orbit, "message": message})
            temporary.write_text(content, encoding="utf-8")

    def remove_abandoned(self) -> None:
        """Remove what killed processes left: scratch folders, failures of orbits fitted since."""
        for folder in (self.directory, self.directory / _FAILED):
            remove_abandoned(folder)
        for orbit in self.complete_orbits():
            # A read-only disk refuses to remove even a file that is not there.
            if self._failure_path(orbit).is_file():
                self._failure_path(orbit).unlink(missing_ok=True)

    def gathered_orbits(self) -> list[int]:
        """Return the orbits that the tables over all orbits contain."""
        path = self.directory / _GATHERED
        self.require_unchanged(_GATHERED)
        if not path.is_file():
            return []
        return _gathered(path).orbits

    def begin_gathering(self) -> None:
        """Remove the record of gathered orbits, before the tables over all orbits are written."""
        (self.directory / _GATHERED).unlink(missing_ok=True)

    def mark_gathered(self, orbits: list[int]) -> None:
        """Record the gathered orbits; call after the tables over all orbits are written."""
        tables = {
            name: sha256_of(self.directory / name)
            for name in _TABLES
            if (self.directory / name).is_file()
        }
        with write_atomically(self.directory / _GATHERED) as temporary:
            content = json.dumps({"orbits": orbits, "sha256": tables})
            temporary.write_text(content, encoding="utf-8")

    def mark_complete(self) -> None:
        """Mark the run as complete; it is not changed afterwards."""
        names = [
            name for name in (RUN_FILE, _GATHERED, *_TABLES) if (self.directory / name).is_file()
        ]
        manifest = manifest_of(self.directory, names)
        with write_atomically(self.directory / _COMPLETE) as temporary:
            temporary.write_text(manifest, encoding="utf-8")

    def _listed(self) -> Mapping[str, str]:
        """Return name -> SHA-256 of the files that belong to no orbit, as far as recorded."""
        if self.is_complete:
            return read_manifest(self.directory / _COMPLETE)
        path = self.directory / _GATHERED
        return _gathered(path).digests if path.is_file() else {}

    def _table_changes(self) -> list[str]:
        if self.is_complete:
            return list(changes(self.directory, self.directory / _COMPLETE, _REMEDY))
        found = []
        for name in _TABLES:
            try:
                self.require_unchanged(name)
            except InputError as error:
                found.append(str(error))
        return found

    def _orbits_there(self) -> list[int]:
        """Return the orbits that have a directory, whether they are complete or not."""
        found = (_ORBIT.fullmatch(path.name) for path in self.directory.glob("orbit=*"))
        return sorted(int(match[1]) for match in found if match)

    def _failure_path(self, orbit: int) -> Path:
        return self.directory / _FAILED / f"orbit={orbit:04d}.json"


class _Gathered(NamedTuple):
    """The gathered orbits, and name -> SHA-256 of the tables over them."""

    orbits: list[int]
    digests: dict[str, str]


def _gathered(path: Path) -> _Gathered:
    with reading(str(path), "the orbits in the tables of a run"):
        content = json.loads(path.read_text(encoding="utf-8"))
        # Older versions wrote the orbits only.
        found = {"orbits": content, "sha256": {}} if isinstance(content, list) else content
        digests = {str(name): str(digest) for name, digest in found["sha256"].items()}
        return _Gathered([int(orbit) for orbit in found["orbits"]], digests)


def run_directories(survey: Path) -> list[RunDirectory]:
    """Return the directories of the runs of a survey, by name."""
    folder = Path(survey) / "runs"
    names = sorted(path.parent.name for path in folder.glob(f"*/{RUN_FILE}"))
    return [RunDirectory(Path(survey), name) for name in names]
