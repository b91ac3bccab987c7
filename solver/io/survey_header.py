"""Headers in TOML: of a survey, of one that is unfinished, and of a run."""

from collections.abc import Mapping
from pathlib import Path

from solver.data.toml import parse_toml, toml_text
from solver.errors import InputError
from solver.io.atomic import write_atomically
from solver.io.survey_manifest import require_unchanged_files

FORMAT = 1
HEADER = "survey.toml"
# Of a survey whose simulation was interrupted.
UNFINISHED = "unfinished.toml"


def read_header(directory: Path, name: str = HEADER, of: str = "survey") -> dict[str, object]:
    """Return the content of a header, such as a survey's.

    Parameters
    ----------
    name : file name; differs for an unfinished survey
    of : what the directory is

    Raises
    ------
    InputError
        If the file is missing or unreadable, or its format is not supported.
    """
    path = Path(directory) / name
    if name == HEADER and path.is_file():
        require_unchanged_files(Path(directory), [path])
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        found = found_unfinished(Path(directory)) if name == HEADER else "none"
        raise InputError(
            f"{directory}: expected a {of} with a file {name}, found {found}"
        ) from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected the header of a {of}, found: {error}") from error
    content = parse_toml(text, path, f"the header of a {of}")
    if content.get("format") != FORMAT:
        raise InputError(
            f"{path}: expected format = {FORMAT}, found {content.get('format', 'no format')!r}"
        )
    return content


def found_unfinished(directory: Path) -> str:
    """Return what to say of a directory without a survey's header: why it has none, or "none"."""
    if not (directory / UNFINISHED).is_file():
        return "none"
    return "an unfinished one: the command `plateviz simulate` that started it completes it"


def section(header: Mapping[str, object], name: str) -> Mapping[str, object]:
    """Return a section of a header; an empty one if it is absent."""
    found = header.get(name)
    return found if isinstance(found, Mapping) else {}


def write_header(directory: Path, content: Mapping[str, object], name: str = HEADER) -> None:
    """Write a survey's header; values are text, numbers, lists and mappings (TOML tables).

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with write_atomically(Path(directory) / name) as path:
        path.write_text(header_text(content), encoding="utf-8")


def header_text(content: Mapping[str, object]) -> str:
    """Return the text of a header with its format."""
    return toml_text({"format": FORMAT, **content})
