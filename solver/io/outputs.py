"""Checks of the output files of a command, before the command starts its work."""

import os
from collections.abc import Iterable
from pathlib import Path

from solver.errors import InputError
from solver.io.atomic import require_writable

FITS_SUFFIXES = (".fits", ".fit", ".fts")
PAGE_SUFFIXES = (".html", ".htm")


def check_output(
    path: Path, suffixes: tuple[str, ...], inputs: Iterable[Path] = (), overwrite: bool = False
) -> None:
    """Refuse a file that must not be written, or could not be read back.

    Parameters
    ----------
    path : the file to write
    suffixes : suffixes that the readers of such a file accept; any suffix if empty
    inputs : files that are read to make it
    overwrite : whether an existing file may be replaced; an input never is

    Raises
    ------
    InputError
        If the suffix is not one of `suffixes`, the folder cannot be written, `path` is one of the
        inputs under this or another name, or it exists and must not be replaced.
    """
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(
            f"{path}: expected a name that ends in {_either(suffixes)}, found {path.name!r}"
        )
    require_writable(path)
    for one in inputs:
        if _is_same(path, one):
            raise InputError(
                f"{path}: expected another file than the inputs, found {one}, which would be lost"
            )
    if path.exists() and not overwrite:
        raise InputError(
            f"{path}: expected a new file, found one that exists; overwriting has to be asked for "
            "(--overwrite; overwrite=True in a notebook)"
        )


def _is_same(path: Path, other: Path) -> bool:
    # Names that differ may be links to one file, or differ in case only.
    if path.exists() and other.exists():
        return path.samefile(other)
    return os.path.realpath(path) == os.path.realpath(other)


def _either(names: tuple[str, ...]) -> str:
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last
