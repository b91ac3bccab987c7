"""New runs: created with their settings, or found with the same ones."""

import re
from collections.abc import Mapping
from pathlib import Path

from plateviz.runs.run import RUN_FILE, Run
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.disk import writing
from solver.io.scratch import is_scratch
from solver.io.survey import (
    EXPOSURES,
    HEADER,
    REFERENCE,
    TRUTH_FILE,
    read_header,
    section,
    survey_orbits,
    write_header,
)
from solver.runtime.versions import versions_of

# Their versions belong to a run: results may differ between versions.
PACKAGES = ("plateviz", "jax", "numpy", "scipy", "pyerfa")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def begin_run(survey: Path, name: str, settings: FitSettings) -> Run:
    """Create a run, or return an existing one with the same settings.

    Raises
    ------
    InputError
        If the directory is not a survey, the name is not a valid folder name, or a run of that
        name exists with other settings, versions or inputs.
    """
    survey_orbits(survey)
    if not _NAME.fullmatch(name):
        raise InputError(
            f"--run: expected a name of letters, digits, '.', '-' and '_', found {name!r}"
        )
    run, content = Run(Path(survey), name), _content(Path(survey), settings)
    path = run.directory / RUN_FILE
    if path.is_file():
        _check_same(path, read_header(run.directory, RUN_FILE), content)
        return run
    if run.directory.is_dir() and not all(is_scratch(p.name) for p in run.directory.iterdir()):
        raise InputError(f"{run.directory}: expected a run, found a folder without {RUN_FILE}")
    with writing(run.directory, "to create the folder"):
        run.directory.mkdir(parents=True, exist_ok=True)
    write_header(run.directory, content, RUN_FILE)
    return run


def _content(survey: Path, settings: FitSettings) -> dict[str, object]:
    inputs = [survey / name for name in (HEADER, REFERENCE, TRUTH_FILE, EXPOSURES)]
    return {
        "versions": versions_of(PACKAGES),
        "inputs": {path.name: sha256_of(path) for path in inputs if path.is_file()},
        "settings": settings.to_dict(),
    }


def _check_same(path: Path, found: Mapping[str, object], wanted: Mapping[str, object]) -> None:
    different = [
        f"{title} ({name})"
        for title in wanted
        for name in sorted({**section(wanted, title), **section(found, title)})
        if section(wanted, title).get(name) != section(found, title).get(name)
    ]
    if different:
        raise InputError(
            f"{path}: expected the settings with which this run was created, found other "
            f"{', '.join(different)}; use another --run NAME to keep both"
        )
