"""Origins of orbits: a survey directory, or the files of one orbit.

An origin consists of plain values, so that the web process, which never loads measurements, can
send it to the solver process, which does.
"""

import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from plateviz.runs.kept_solutions import FOLDER
from solver.data.instrument import MINI_MOCK, Instrument, read_instrument
from solver.data.orbit import OrbitData
from solver.io.read_orbit import observation_files, read_orbit
from solver.io.survey import (
    REFERENCE,
    TRUTH_FILE,
    measurement_path,
    read_survey_instrument,
    read_survey_orbit,
    survey_orbits,
)
from solver.io.survey_header import HEADER
from solver.simulate.settings import SurveySettings
from solver.simulate.simulated import simulation_of

FileStates = list[tuple[int, int, int]]


@dataclass(frozen=True)
class OrbitFiles:
    """The files of one orbit, as on the command line.

    Attributes
    ----------
    observations, reference, truth, instrument : paths; the last two may be None
    orbit : orbit_id, or None if the file holds one orbit only
    """

    observations: str
    reference: str
    truth: str | None = None
    orbit: int | None = None
    instrument: str | None = None

    @property
    def title(self) -> str:
        """Name of the origin."""
        return Path(self.observations).name

    @property
    def solutions(self) -> Path:
        """Directory of the kept solutions, which need not exist."""
        path = Path(self.observations)
        return path.parent / f"{path.name.partition('.')[0]}-{FOLDER}"

    def inputs(self) -> list[Path]:
        """Return the files that are read, whether they exist or not."""
        given = (self.reference, self.truth, self.instrument)
        files = [Path(path) for path in given if path]
        return [*observation_files(Path(self.observations)), *files]

    def state(self, orbit: int | None) -> FileStates:
        """Return what differs once a file of the orbit has been changed."""
        return _states(self.inputs())

    def orbits(self) -> list[int | None]:
        """Return the orbit_id of all orbits."""
        return [self.orbit]

    def read(self, orbit: int | None) -> OrbitData:
        """Read and check one orbit; InputError if the files are invalid."""
        truth = Path(self.truth) if self.truth else None
        return read_orbit(Path(self.observations), Path(self.reference), truth, orbit)

    def read_instrument(self) -> Instrument:
        """Return the instrument that took the orbit."""
        return read_instrument(Path(self.instrument)) if self.instrument else MINI_MOCK

    def read_simulation(self) -> SurveySettings | None:
        """Return None: files do not say how they were simulated."""
        return None


@dataclass(frozen=True)
class SurveyFolder:
    """A survey directory, as `plateviz simulate` writes it."""

    directory: str

    @property
    def title(self) -> str:
        """Name of the origin."""
        return Path(os.path.realpath(self.directory)).name

    @property
    def solutions(self) -> Path:
        """Directory of the kept solutions, which need not exist."""
        return Path(self.directory) / FOLDER

    def state(self, orbit: int | None) -> FileStates:
        """Return what differs once a file of an orbit has been changed; orbits may be added."""
        folder = Path(self.directory)
        own = [] if orbit is None else [measurement_path(folder, orbit)]
        return _states([*own, folder / REFERENCE, folder / TRUTH_FILE, folder / HEADER])

    def orbits(self) -> list[int | None]:
        """Return the orbit_id of all orbits."""
        return list(survey_orbits(Path(self.directory)))

    def read(self, orbit: int | None) -> OrbitData:
        """Read and check one orbit; InputError if the files are invalid."""
        if orbit is None:
            raise ValueError("orbit: expected an orbit_id of the survey, found None")
        return read_survey_orbit(Path(self.directory), orbit)

    def read_instrument(self) -> Instrument:
        """Return the instrument that took the orbits."""
        return read_survey_instrument(Path(self.directory))

    def read_simulation(self) -> SurveySettings | None:
        """Return the settings with which the orbits were simulated; None for others."""
        return simulation_of(Path(self.directory))


Origin = OrbitFiles | SurveyFolder


def _states(paths: list[Path]) -> FileStates:
    """Return number, size and time of writing (ns) of the files that exist."""
    found = []
    for path in paths:
        # One may vanish meanwhile.
        with suppress(OSError):
            if path.is_file():
                one = path.stat()
                found.append((one.st_ino, one.st_size, one.st_mtime_ns))
    return found


def origin_to_dict(origin: Origin) -> dict[str, object]:
    """Return an origin as plain values; `origin_from_dict` reads them back."""
    return {"kind": type(origin).__name__, **asdict(origin)}


def origin_from_dict(values: dict[str, object]) -> Origin:
    """Return the origin that `origin_to_dict` wrote."""
    kinds = {kind.__name__: kind for kind in (OrbitFiles, SurveyFolder)}
    rest = {name: value for name, value in values.items() if name != "kind"}
    return kinds[str(values["kind"])](**rest)  # type: ignore[arg-type]
