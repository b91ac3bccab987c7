"""The largest tables that are read: a damaged size must not take a machine's memory."""

from pathlib import Path

from solver.errors import InputError

MAX_BYTES = 2 * 1024**3
MAX_ROWS = 20_000_000

_BYTES_PER_CELL = 8


def check_size(path: Path, rows: int, columns: int) -> None:
    """Refuse a table of more rows or bytes than are read.

    Raises
    ------
    InputError
        If there are more than `MAX_ROWS` rows, or more than `MAX_BYTES` at eight bytes a cell.
    """
    size = rows * columns * _BYTES_PER_CELL
    if rows > MAX_ROWS or size > MAX_BYTES:
        raise InputError(
            f"{path}: expected at most {MAX_ROWS} rows and {MAX_BYTES} bytes, "
            f"found {rows} rows of {columns} columns"
        )
