"""Notes: short texts that people write about a run or a kept solution, in a file beside it."""

import hashlib
import unicodedata
from pathlib import Path
from typing import NamedTuple

from solver.errors import InputError
from solver.io.atomic import write_atomically
from solver.io.failures import reading
from solver.io.lock import locked

NOTE_FILE = "note.txt"
MOST_BYTES = 8_000
# Of characters that let what follows run, or be shown, in another direction.
_DIRECTIONS = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")


class Note(NamedTuple):
    """A note as it was read.

    Attributes
    ----------
    text : shown as it is, never as markup
    version : differs from that of any other text
    """

    text: str
    version: str


class NoteChangedError(InputError):
    """Somebody else has changed the note in the meantime.

    Attributes
    ----------
    note : as it is now
    """

    def __init__(self, note: Note) -> None:
        """Say so."""
        super().__init__("somebody else has changed this note in the meantime; nothing was saved")
        self.note = note


def read_note(path: Path) -> Note:
    """Return a note; an empty one if there is no file.

    Raises
    ------
    InputError
        If the file is no text, or too long to be a note.
    """
    if not path.is_file():
        return _note("")
    with reading(str(path), "a note"), path.open("rb") as stream:
        content = stream.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise InputError(f"{path}: expected a note of {MOST_BYTES:,} bytes or fewer")
        return _note(content.decode("utf-8"))


def write_note(path: Path, text: str, version: str) -> Note:
    """Write a note in place of the one that was read, and return it.

    Parameters
    ----------
    path : of the note, in an existing directory
    version : of the note that the text was made from

    Raises
    ------
    NoteChangedError
        If the note is another one by now; nothing is written.
    DiskError
        If the disk is full or takes no file for another reason.
    InputError
        If the text is too long.
    """
    text = "".join(filter(_is_text, text.replace("\r\n", "\n"))).strip()
    content = text.encode("utf-8", "replace")
    if len(content) > MOST_BYTES:
        raise InputError(
            f"expected a note of {MOST_BYTES:,} bytes or fewer, found {len(content):,}"
        )
    if not path.parent.is_dir():
        raise InputError(f"{path.parent}: expected the directory of the note, found none")
    with locked(path.parent, wait=True):
        now = read_note(path)
        if now.version != version:
            raise NoteChangedError(now)
        with write_atomically(path) as temporary:
            temporary.write_bytes(content)
    return _note(content.decode("utf-8"))


def _is_text(character: str) -> bool:
    """Return whether a character is no control character, and changes no direction of the text."""
    if character in "\n\t":
        return True
    is_control = unicodedata.category(character) in ("Cc", "Cs", "Co", "Cn")
    return not is_control and unicodedata.bidirectional(character) not in _DIRECTIONS


def _note(text: str) -> Note:
    return Note(text, hashlib.sha256(text.encode()).hexdigest())
