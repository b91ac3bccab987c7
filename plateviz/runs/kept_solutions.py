"""Kept solutions: fitted orbits that a person has named and kept, each a directory of its own.

    solutions/NAME/orbit=0003/     one fitted orbit (`plateviz.runs.fitted_orbit`); a solution by a
                                   what-if is in `what-if=0003`, one of files in `orbit=file`
    solutions/NAME/note.txt        what people wrote about it (`plateviz.runs.note`)

They are in the survey's directory, or beside the files of an orbit. A run has every orbit with the
same settings, so that a single solution is none. What is kept never changes, its note does.
"""

import re
from pathlib import Path
from typing import NamedTuple

from plateviz.runs.fitted_orbit import (
    is_complete,
    read_fitted_orbit,
    read_settings,
    write_fitted_orbit,
)
from plateviz.runs.note import NOTE_FILE
from solver.data.instrument import MINI_MOCK, Instrument
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.atomic import flush
from solver.io.disk import writing
from solver.io.result_instrument import require_instrument
from solver.io.scratch import scratch_beside
from solver.io.survey import read_survey_instrument
from solver.io.survey_header import HEADER
from solver.simulate.settings import SurveySettings
from solver.simulate.simulated import simulation_of

FOLDER = "solutions"
# Whoever can open a dashboard can keep solutions; each takes some 30 MB.
MOST = 200
_REMEDY = "fit the orbit with these settings again, and keep it under another name"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,59}")
_DIRECTORY = re.compile(r"(?P<kind>orbit|what-if)=(?P<orbit>\d{4,18}|file)")


class KeptSolution(NamedTuple):
    """One kept solution.

    Attributes
    ----------
    directory : with the fitted orbit
    orbit : orbit_id; None for files of one orbit
    is_what_if : whether it was computed by a what-if
    """

    directory: Path
    orbit: int | None
    is_what_if: bool

    @property
    def name(self) -> str:
        """The name that a person gave it."""
        return self.directory.parent.name

    @property
    def note_path(self) -> Path:
        """The file of its note."""
        return self.directory.parent / NOTE_FILE

    def settings(self) -> FitSettings:
        """Return its settings; InputError if it is damaged."""
        return read_settings(self.directory)

    def read(self) -> FitResult:
        """Read it; InputError if it is damaged."""
        return read_fitted_orbit(self.directory, _REMEDY)


class KeptSolutions:
    """The kept solutions of one survey, or of the files of one orbit."""

    def __init__(self, folder: Path, instrument: Instrument = MINI_MOCK) -> None:
        """Look in a folder, which need not exist, for solutions with an instrument."""
        self.folder = folder
        self._instrument = instrument

    def all(self) -> list[KeptSolution]:
        """Return the kept solutions by name."""
        try:
            paths = sorted(self.folder.iterdir()) if self.folder.is_dir() else []
        except OSError:
            return []
        return [found for path in paths if (found := kept_solution(path)) is not None]

    def find(self, name: str) -> KeptSolution:
        """Return the kept solution of that name.

        Raises
        ------
        InputError
            If there is none.
        """
        found = kept_solution(self.folder / name) if _NAME.fullmatch(name) else None
        if found is None:
            raise InputError(f"expected the name of a kept solution, found {name[:60]!r}")
        return found

    def read(self, kept: KeptSolution) -> FitResult:
        """Read one of them; InputError if it is damaged, or of another instrument."""
        result = kept.read()
        remedy = "`plateviz report` shows it with its own"
        require_instrument(result, self._instrument, f"kept solution {kept.name!r}", remedy)
        return result

    def keep(
        self, name: str, orbit: int | None, is_what_if: bool, result: FitResult
    ) -> KeptSolution:
        """Keep a fitted orbit under a name.

        Raises
        ------
        DiskError
            If the disk is full or takes no file for another reason.
        InputError
            If the name is not valid or not free, or too many solutions are kept.
        """
        require_name(name)
        if len(self.all()) >= MOST:
            raise InputError(f"{self.folder}: {MOST} solutions are kept; remove some first")
        target = self.folder / name
        if target.exists():
            raise InputError(f"expected a name that is free, found a kept solution {name!r}")
        number = "file" if orbit is None else f"{orbit:04d}"
        directory = f"{'what-if' if is_what_if else 'orbit'}={number}"
        with writing(target, "to keep the solution"):
            self.folder.mkdir(parents=True, exist_ok=True)
            with scratch_beside(target) as staging:
                write_fitted_orbit(staging / directory, result)
                staging.rename(target)
            flush(self.folder)
        return KeptSolution(target / directory, orbit, is_what_if)


def require_name(name: str) -> None:
    """Raise `InputError` if a solution cannot be kept under a name, which is that of a folder."""
    if not _NAME.fullmatch(name):
        raise InputError(
            "expected a name of up to 60 letters A to Z or a to z, digits, '.', '-' and '_' that "
            f"begins with a letter or digit, found {name[:60]!r}"
        )


def survey_instrument_of(kept: KeptSolution) -> Instrument:
    """Return the instrument of the survey that a solution is kept in; the mini-mock's of files."""
    survey = kept.directory.parent.parent.parent
    return read_survey_instrument(survey) if (survey / HEADER).is_file() else MINI_MOCK


def simulation_of_kept(kept: KeptSolution) -> SurveySettings | None:
    """Return the settings with which the survey that a solution is kept in was simulated."""
    survey = kept.directory.parent.parent.parent
    return simulation_of(survey) if (survey / HEADER).is_file() else None


def kept_solution(path: Path) -> KeptSolution | None:
    """Return the kept solution in a directory; None if it is none."""
    try:
        entries = sorted(path.iterdir()) if path.is_dir() else []
    except OSError:
        return None
    for entry in entries:
        match = _DIRECTORY.fullmatch(entry.name)
        if match is not None and is_complete(entry):
            orbit = None if match["orbit"] == "file" else int(match["orbit"])
            return KeptSolution(entry, orbit, match["kind"] == "what-if")
    return None
