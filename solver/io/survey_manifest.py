"""The manifest of a survey: which files it has, and whether they are as they were written."""

import time
from pathlib import Path

from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.lock import locked
from solver.io.manifest import changes, read_manifest, require_digest, require_unchanged

MANIFEST = "manifest.sha256"
REMEDY = (
    f"restore it from a copy, or simulate the survey again; if it was changed on purpose, delete "
    f"{MANIFEST}"
)
# An orbit that is added replaces the exposures a moment before the manifest: less than one of
# these times, or on a slow disk as long as whoever adds it has the folder locked.
_MOMENT_S, _MOST_S = 0.1, 3.0


def listed_files(directory: Path) -> dict[str, str]:
    """Return name -> SHA-256 of the files that the manifest lists; none without a manifest.

    Raises
    ------
    InputError
        If the manifest cannot be read.
    """
    manifest = directory / MANIFEST
    return read_manifest(manifest) if manifest.is_file() else {}


def survey_changes(directory: Path) -> list[str]:
    """Return a message for each file of a survey that is not as it was written."""
    manifest = directory / MANIFEST
    return list(changes(directory, manifest, REMEDY)) if manifest.is_file() else []


def require_unchanged_files(directory: Path, paths: list[Path]) -> dict[str, str]:
    """Return name -> SHA-256 of files; InputError if a manifest has others."""
    try:
        return _unchanged(directory, paths)
    except InputError:
        end = time.monotonic() + _MOST_S
        time.sleep(_MOMENT_S)
        while _is_growing(directory) and time.monotonic() < end:
            time.sleep(_MOMENT_S)
        return _unchanged(directory, paths)


def _is_growing(directory: Path) -> bool:
    """Return whether another process adds an orbit."""
    try:
        with locked(directory) as is_free:
            return not is_free
    except OSError:
        return False


def _unchanged(directory: Path, paths: list[Path]) -> dict[str, str]:
    wanted, found = listed_files(directory), {}
    for path in paths:
        name = path.relative_to(directory).as_posix()
        if not path.is_file():
            require_unchanged(path, wanted.get(name), REMEDY)
        found[name] = sha256_of(path)
        require_digest(path, found[name], wanted.get(name), REMEDY)
    return found
