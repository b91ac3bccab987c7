"""Manifests: the SHA-256 of every file of a folder, as `sha256sum --check` reads them too."""

import re
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from solver.errors import InputError
from solver.io.atomic import sha256_of

# A file may be written again within the resolution of the times of files.
_SETTLED_NANOSECONDS = 2 * 10**9
_LINE = re.compile(r"([0-9a-f]{64})  (\S.*)")


def manifest_of(folder: Path, names: Iterable[str]) -> str:
    """Return the manifest of files, a line each.

    Parameters
    ----------
    names : of the files, relative to `folder`

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    return manifest_text({name: sha256_of(folder / name) for name in sorted(names)})


def manifest_text(digests: Mapping[str, str]) -> str:
    """Return the manifest of file name -> SHA-256, a line each."""
    return "".join(f"{digest}  {name}\n" for name, digest in digests.items())


def read_manifest(path: Path) -> dict[str, str]:
    """Return file name -> SHA-256; nothing if the file is empty, as older versions wrote it.

    Raises
    ------
    InputError
        If the file cannot be read or is no manifest.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a manifest, found: {error}") from error
    found = [_LINE.fullmatch(line) for line in lines]
    if not all(found):
        raise InputError(f"{path}: expected a SHA-256 and a file name in each line, found others")
    return {match[2]: match[1] for match in found if match}


def require_unchanged(path: Path, wanted: str | None, remedy: str) -> None:
    """Refuse a file that is not the one that was written.

    Parameters
    ----------
    wanted : its SHA-256 in the manifest; None if that has none
    remedy : what to do about it, a sentence without its full stop

    Raises
    ------
    InputError
        If the file is missing or its contents are others.
    """
    if wanted is None:
        return
    if not path.is_file():
        raise InputError(f"{path}: expected the file that was written, found none; {remedy}")
    require_digest(path, sha256_of(path), wanted, remedy)


class UnchangedFiles:
    """Files that were found unchanged: each is read as a whole once, and again if it is written."""

    def __init__(self) -> None:
        """Begin without any."""
        self._found: set[tuple[Path, str, int, int]] = set()

    def require(self, path: Path, wanted: str | None, remedy: str) -> None:
        """Refuse a file that is not the one that was written, as `require_unchanged` does."""
        if wanted is None or not path.is_file():
            require_unchanged(path, wanted, remedy)
            return
        state = path.stat()
        found = (path, wanted, state.st_size, state.st_mtime_ns)
        if found not in self._found:
            require_unchanged(path, wanted, remedy)
            if time.time_ns() - state.st_mtime_ns > _SETTLED_NANOSECONDS:
                self._found.add(found)


def require_digest(path: Path, found: str, wanted: str | None, remedy: str) -> None:
    """Refuse a file with the SHA-256 `found` instead of `wanted`, as `require_unchanged` does."""
    if wanted is not None and found != wanted:
        raise InputError(
            f"{path}: expected the file that was written, found other contents (its SHA-256 is not "
            f"that of the manifest); {remedy}"
        )


def changes(folder: Path, manifest: Path, remedy: str) -> Iterator[str]:
    """Yield a message for each file of a manifest that is missing or has other contents."""
    try:
        listed = read_manifest(manifest)
    except InputError as error:
        yield f"{error}; {remedy}"
        return
    for name, digest in listed.items():
        try:
            require_unchanged(folder / name, digest, remedy)
        except InputError as error:
            yield str(error)
