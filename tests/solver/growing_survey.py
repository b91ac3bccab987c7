"""A survey that grows: the first orbits of a whole one, to which the others are added."""

import shutil
from pathlib import Path

from solver.data.schema import ENVIRONMENT
from solver.io.manifest import manifest_of
from solver.io.survey import (
    EXPOSURES,
    REFERENCE,
    TRUTH_FILE,
    measurement_path,
    read_survey_orbit,
    read_survey_table,
    write_survey_table,
)
from solver.io.survey_growth import append_orbit
from solver.io.survey_header import HEADER
from solver.io.survey_manifest import MANIFEST


class GrowingSurvey:
    """The orbits below `n` of a survey, in a directory of their own."""

    def __init__(self, whole: Path, directory: Path, n: int) -> None:
        self.whole, self.directory = whole, directory
        (directory / "measurements").mkdir(parents=True)
        for name in (HEADER, REFERENCE, TRUTH_FILE):
            shutil.copy(whole / name, directory / name)
        if n:
            exposures = read_survey_table(whole / EXPOSURES, ENVIRONMENT)
            some = exposures[exposures["orbit_id"] < n]
            write_survey_table(some, ENVIRONMENT, directory / EXPOSURES)
        for orbit in range(n):
            shutil.copy(measurement_path(whole, orbit), self.file(orbit))
        self.write_manifest()

    def file(self, orbit: int) -> Path:
        return measurement_path(self.directory, orbit)

    def content(self, orbit: int) -> bytes:
        return measurement_path(self.whole, orbit).read_bytes()

    def append(self, orbit: int) -> None:
        append_orbit(self.directory, read_survey_orbit(self.whole, orbit))

    def write_manifest(self) -> None:
        files = [*self.directory.glob("*.parquet"), *self.directory.glob("measurements/*")]
        names = [path.relative_to(self.directory).as_posix() for path in files]
        text = manifest_of(self.directory, [*names, HEADER])
        (self.directory / MANIFEST).write_text(text)
