"""New runs: created with their settings, or found with the same ones; and fitted by one process."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from plateviz.runs.run_directory import GROWS, RUN_FILE, RunDirectory
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.disk import writing
from solver.io.lock import locked
from solver.io.scratch import is_scratch
from solver.io.survey import EXPOSURES, REFERENCE, TRUTH_FILE, survey_orbits
from solver.io.survey_header import HEADER, read_header, section, write_header
from solver.runtime.versions import versions_of

# Their versions belong to a run: results may differ between versions.
PACKAGES = ("plateviz", "jax", "numpy", "scipy", "pyerfa")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


def begin_run(survey: Path, name: str, settings: FitSettings, grows: bool = False) -> RunDirectory:
    """Create a run, or return an existing one with the same settings.

    Parameters
    ----------
    grows : whether orbits may be added to the survey while the run is fitted; a run that exists
        stays what it is

    Raises
    ------
    InputError
        If the directory is not a survey, the name is not a valid folder name, or a run of that
        name exists with other settings, versions or inputs, or has to grow and does not.
    """
    survey_orbits(survey)
    if not _NAME.fullmatch(name):
        raise InputError(
            f"--run: expected a name of up to 100 letters, digits, '.', '-' and '_' that "
            f"begins with a letter or digit, found {name[:60]!r}"
        )
    run = RunDirectory(Path(survey), name)
    path = run.directory / RUN_FILE
    if path.is_file():
        _check_same(path, run, _content(run.survey, settings, run.grows))
        if grows and not run.grows:
            raise InputError(
                f"{path}: expected a run that `plateviz watch` began, found one of the orbits that "
                "the survey had when `plateviz survey` began it; give another --run NAME"
            )
        return run
    if run.directory.is_dir() and not all(is_scratch(p.name) for p in run.directory.iterdir()):
        raise InputError(f"{run.directory}: expected a run, found a folder without {RUN_FILE}")
    with writing(run.directory, "to create the folder"):
        run.directory.mkdir(parents=True, exist_ok=True)
    content = _content(run.survey, settings, grows)
    write_header(run.directory, {GROWS: True, **content} if grows else content, RUN_FILE)
    return run


@contextmanager
def fitting_alone(run: RunDirectory) -> Iterator[None]:
    """Let no other process fit a run while the block runs; InputError if one is fitting it."""
    with locked(run.directory) as is_ours:
        if not is_ours:
            raise InputError(
                f"{run.directory}: expected a run that no other process is fitting, found one that "
                "another process is fitting; wait for it, or give another --run NAME"
            )
        yield


def _content(survey: Path, settings: FitSettings, grows: bool) -> dict[str, object]:
    # The exposures change with each orbit that is added.
    names = (HEADER, REFERENCE, TRUTH_FILE) if grows else (HEADER, REFERENCE, TRUTH_FILE, EXPOSURES)
    inputs = [survey / name for name in names]
    return {
        "versions": versions_of(PACKAGES),
        "inputs": {path.name: sha256_of(path) for path in inputs if path.is_file()},
        "settings": settings.to_dict(),
    }


def _check_same(path: Path, run: RunDirectory, wanted: Mapping[str, object]) -> None:
    found = read_header(run.directory, RUN_FILE, "run")
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
