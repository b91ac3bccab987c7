"""Orbits that arrive in a survey: which can be fitted, which wait, and which have changed.

A file is whole if it is the one that the survey's manifest lists. In a survey without a manifest it
is whole if it did not change between two looks and has the end of a Parquet file. No look reads an
orbit's measurements except to compute their SHA-256, and that once for each time they are written.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from plateviz.runs.fitted_exposures import FittedExposures, digest_of
from plateviz.runs.fitted_orbit import read_provenance
from plateviz.runs.run_directory import RunDirectory
from solver.data.schema import ENVIRONMENT
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.consistency import repeated_orbits
from solver.io.parquet import count_rows
from solver.io.survey import (
    EXPOSURES,
    MEASUREMENTS,
    measurement_path,
    read_survey_table,
    survey_orbits,
)
from solver.io.survey_header import HEADER, read_header
from solver.io.survey_manifest import MANIFEST, listed_files
from solver.io.survey_problems import misnamed_orbits


class Remark(NamedTuple):
    """What is to be said of an orbit that is not fitted now.

    Attributes
    ----------
    kind : "waiting" for files that are not whole yet, "damaged" for one that is not what it should
        be, "changed" for an orbit that was fitted with other measurements or exposures
    orbit : its id; None if it is about the survey
    message : in words
    """

    kind: str
    orbit: int | None
    message: str

    @property
    def is_fault(self) -> bool:
        """Whether somebody has to mend what is there, or cannot be read."""
        return self.kind == "damaged" or (self.kind == "waiting" and self.orbit is None)


class Look(NamedTuple):
    """What a survey has at one moment.

    Attributes
    ----------
    ready : orbits that are whole and have not been tried as they are
    remarks : on the others that are not fitted, or not as they are
    is_settled : whether no orbit waits because it was just written
    """

    ready: list[int]
    remarks: list[Remark]
    is_settled: bool


class _State(NamedTuple):
    """State of a file, which changes when it is written."""

    size: int
    modified: int
    number: int


_Signature = tuple[_State | None, str | None, str | None]


class Arrivals:
    """The orbits of a growing survey, look by look."""

    def __init__(self, run: RunDirectory) -> None:
        """Begin without a look.

        Parameters
        ----------
        run : contains the orbits that are fitted

        Raises
        ------
        InputError
            If the record of their exposures is damaged.
        """
        self._run, self._survey = run, run.survey
        self._listed: dict[str, str] = {}
        # States of the files that are not fitted, at this look and at the one before.
        self._states: dict[Path, _State | None] = {}
        self._before: dict[Path, _State | None] = {}
        self._digests: dict[Path, tuple[_State | None, str]] = {}
        self._exposures: dict[int, str] = {}
        self._exposures_read: object = None
        # Orbit -> those that have the same exposures, itself among them.
        self._copies: dict[int, tuple[int, ...]] = {}
        self._fitted_exposures = FittedExposures(run.directory)
        # Of fitted orbits: the SHA-256 of the files that were fitted, and the state of the
        # measurements at the first look.
        self._fitted: dict[int, tuple[Mapping[str, str], _State | None]] = {}
        self._tried: dict[int, _Signature] = {}

    def look(self) -> Look:
        """Look at the files of the survey.

        Raises
        ------
        InputError
            If the survey is gone.
        """
        if not (self._survey / HEADER).is_file():
            raise InputError(
                f"{self._survey}: expected the survey that is watched, found none there any more"
            )
        try:
            orbits = self._read()
        except InputError as error:
            # An orbit may be being added.
            return Look([], [Remark("waiting", None, f"{error}")], is_settled=False)
        fitted = set(self._run.complete_orbits())
        # One that another process has fitted is compared with what it is at the first look.
        self._record(one for one in fitted if self._fitted_exposures.of(one) is None)
        files = {one: measurement_path(self._survey, one) for one in orbits if one not in fitted}
        self._before, self._states = self._states, {p: _state_of(p) for p in files.values()}
        found = {one: self._remark_on(one, fitted) for one in orbits}
        remarks = [*self._misnamed(), *(remark for remark in found.values() if remark is not None)]
        ready = [one for one in files if found[one] is None and not self._was_tried(one)]
        waiting = {remark.orbit for remark in remarks if remark.kind == "waiting"}
        is_settled = all(self._has_settled(path) for one, path in files.items() if one in waiting)
        return Look(ready, remarks, is_settled)

    def try_orbits(self, orbits: Iterable[int]) -> None:
        """Record that orbits are fitted as they are; one is ready again once it has changed."""
        orbits = list(orbits)
        self._tried |= {orbit: self._signature(orbit) for orbit in orbits}
        self._record(orbits)

    def is_as_tried(self, orbit: int) -> bool:
        """Return whether the files of an orbit are those that it was tried with."""
        try:
            self._read()
        except InputError:
            return False
        return self._was_tried(orbit)

    def _read(self) -> list[int]:
        """Read what all orbits share, and return their ids; InputError if that is not whole."""
        read_header(self._survey)
        self._listed = listed_files(self._survey)
        path = self._survey / EXPOSURES
        state = _state_of(path), self._listed.get(EXPOSURES)
        # A survey may begin without exposures.
        if state != self._exposures_read and state != (None, None):
            table = read_survey_table(path, ENVIRONMENT)
            self._exposures = {int(one): digest_of(rows) for one, rows in table.groupby("orbit_id")}
            self._copies = {one: group for group in repeated_orbits(table) for one in group}
            self._exposures_read = state
        return survey_orbits(self._survey)

    def _remark_on(self, orbit: int, fitted: set[int]) -> Remark | None:
        """Return what there is to say of an orbit: why it is not ready, or what has changed."""
        if orbit in fitted:
            return self._changed(orbit)
        return self._unfit(orbit) or self._copied(orbit, fitted)

    def _was_tried(self, orbit: int) -> bool:
        """Return whether an orbit was tried with its files as they are at this look."""
        return self._tried.get(orbit) == self._signature(orbit)

    def _unfit(self, orbit: int) -> Remark | None:
        """Return why an orbit that is not fitted cannot be fitted yet; None if it can."""
        path = measurement_path(self._survey, orbit)
        name = _name_of(path)
        if self._states[path] is None:
            why = f"{MANIFEST} lists {name}, which" if name in self._listed else name
            return Remark("waiting", orbit, f"{why} is not there yet")
        damage = self._damage(path)
        if damage and not self._has_settled(path):
            return Remark("waiting", orbit, f"{name} is being written")
        if damage:
            return Remark("damaged", orbit, damage)
        if self._listed and name not in self._listed:
            return Remark("waiting", orbit, f"{MANIFEST} does not list {name} yet")
        if orbit not in self._exposures:
            return Remark("waiting", orbit, f"{EXPOSURES} has no exposures of it yet")
        return None

    def _copied(self, orbit: int, fitted: set[int]) -> Remark | None:
        """Return of which orbit that is fitted, or comes before it, one is a copy; None if none."""
        group = self._copies.get(orbit, ())
        others = [one for one in group if one < orbit or (one in fitted and one != orbit)]
        if not others:
            return None
        words = f"its exposures have the times and pointings of orbit {others[0]}"
        return Remark("damaged", orbit, words)

    def _damage(self, path: Path) -> str:
        """Return why a file is not known to be whole; empty if it is."""
        name = _name_of(path)
        try:
            if not self._listed:
                count_rows(str(path))
                return "" if self._has_settled(path) else "it may still be written"
            is_listed = name not in self._listed or self._digest(path) == self._listed[name]
        except InputError as error:
            return str(error)
        return "" if is_listed else f"{path} is not the file that {MANIFEST} lists"

    def _changed(self, orbit: int) -> Remark | None:
        """Return how the files of a fitted orbit differ from those that were fitted, or None."""
        path = measurement_path(self._survey, orbit)
        name = _name_of(path)
        state = _state_of(path)
        if orbit not in self._fitted:
            self._fitted[orbit] = read_provenance(self._run.orbit_directory(orbit)), state
        inputs, first = self._fitted[orbit]
        is_known = state == first and name in self._listed
        if state is None:
            found = f"{name} is gone"
        elif inputs.get(name) != (self._listed[name] if is_known else self._digest(path)):
            found = f"{name} is another file"
        elif self._has_other_exposures(orbit, inputs):
            found = f"its exposures in {EXPOSURES} are others"
        else:
            return None
        return Remark(
            "changed",
            orbit,
            f"{found} since it was fitted; the run keeps its solution, and another --run NAME fits "
            "it as it is now",
        )

    def _has_other_exposures(self, orbit: int, inputs: Mapping[str, str]) -> bool:
        """Return whether an orbit's exposures differ from those that were fitted."""
        path = self._survey / EXPOSURES
        if path.is_file() and inputs.get(EXPOSURES) == self._digest(path):
            return False
        return self._exposures.get(orbit) != self._fitted_exposures.of(orbit)

    def _record(self, orbits: Iterable[int]) -> None:
        """Record the exposures of orbits as those that are fitted."""
        there = self._exposures
        self._fitted_exposures.record({one: there[one] for one in orbits if one in there})

    def _misnamed(self) -> list[Remark]:
        messages = misnamed_orbits(self._survey)
        return [Remark("damaged", None, message) for message in messages]

    def _has_settled(self, path: Path) -> bool:
        """Return whether a file has not been written since the look before."""
        return self._before.get(path) == self._states[path]

    def _digest(self, path: Path) -> str:
        state = _state_of(path)
        if path not in self._digests or self._digests[path][0] != state:
            self._digests[path] = state, sha256_of(path)
        return self._digests[path][1]

    def _signature(self, orbit: int) -> _Signature:
        """Return what changes when an orbit's measurements or exposures are written."""
        path = measurement_path(self._survey, orbit)
        return _state_of(path), self._listed.get(_name_of(path)), self._exposures.get(orbit)


def _state_of(path: Path) -> _State | None:
    """Return the state of a file; None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return _State(found.st_size, found.st_mtime_ns, found.st_ino)


def _name_of(path: Path) -> str:
    return f"{MEASUREMENTS}/{path.name}"
