"""Extents of the HDUs of a FITS file, computed from their mandatory cards.

astropy trusts the headers: NAXIS2 = 1000000000 in a small file makes it allocate that much
memory, and NAXIS = 999999999 keeps it busy for hours. The cards that determine sizes are
therefore checked here against the size of the file, before astropy opens it.
"""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from solver.errors import InputError
from solver.io.limits import MAX_BYTES, MAX_ROWS

_BLOCK = 2880
_CARD = 80
_MAX_HEADER_BYTES = 1000 * _BLOCK
_MAX_HDUS = 1000
_MAX_AXES = 999
_FIRST_CARD = re.compile(rb"SIMPLE  = +T|XTENSION= '\w+")
_INTEGER = re.compile(rb"= +([+-]?\d{1,18}) *(?:/|$)")
_TEXT = re.compile(rb"= +'([^']*)'")
_BITS = (8, 16, 32, 64, -32, -64)


class HduExtent(NamedTuple):
    """Location of one HDU; `end` is the byte after its data, without padding."""

    where: str
    data_start: int
    end: int


def extents(path: Path) -> list[HduExtent]:
    """Return the extents of the HDUs of a FITS file, all of them within the file.

    Raises
    ------
    InputError
        If the file does not start as a FITS file, a header is damaged or specifies more data
        than the file contains or more than `MAX_BYTES`, or other bytes follow the HDUs.
    """
    size = path.stat().st_size
    found: list[HduExtent] = []
    with path.open("rb") as stream:
        start = 0
        while start < size:
            if len(found) == _MAX_HDUS:
                raise InputError(f"{path}: expected at most {_MAX_HDUS} HDUs, found more")
            found.append(_extent(path, stream, start, len(found), size))
            start = -(-found[-1].end // _BLOCK) * _BLOCK
    if not found:
        raise InputError(f"{path}: expected a FITS file, found an empty file")
    return found


def _extent(path: Path, stream: BinaryIO, start: int, index: int, size: int) -> HduExtent:
    stream.seek(start)
    cards = _cards(stream, f"{path}, HDU {index}")
    name = _TEXT.match(cards.get(b"EXTNAME", b""))
    label = name[1].decode("ascii", "replace").strip().upper() if name else ""
    where = f"{path}, HDU {label or index}"
    data_start = stream.tell()
    length = _data_length(cards, where)
    if data_start + length > size:
        raise InputError(
            f"{where}: expected {length} bytes of data as its header says, found "
            f"{max(size - data_start, 0)}: the file is truncated or the header wrong"
        )
    if b"TFIELDS" in cards:
        _check_table(cards, where)
    return HduExtent(where, data_start, data_start + length)


def _cards(stream: BinaryIO, where: str) -> dict[bytes, bytes]:
    """Return keyword -> rest of the card; the first card of a repeated keyword."""
    cards: dict[bytes, bytes] = {}
    for number, card in enumerate(_header(stream, where)):
        if number == 0 and not _FIRST_CARD.match(card):
            raise InputError(
                f"{where}: expected an uncompressed FITS header, which starts with "
                f"'SIMPLE  =' or 'XTENSION=', found {card[:20]!r}"
            )
        cards.setdefault(card[:8].rstrip(), card[8:])
    return cards


def _header(stream: BinaryIO, where: str) -> Iterator[bytes]:
    for _ in range(_MAX_HEADER_BYTES // _BLOCK):
        block = stream.read(_BLOCK)
        for offset in range(0, len(block), _CARD):
            card = block[offset : offset + _CARD]
            if card.rstrip() == b"END" and len(block) == _BLOCK:
                return
            yield card
        if len(block) < _BLOCK:
            break
    raise InputError(f"{where}: expected a header that ends with END, found none")


def _data_length(cards: dict[bytes, bytes], where: str) -> int:
    bits = _integer(cards, "BITPIX", where)
    if bits not in _BITS:
        raise InputError(f"{where}: expected BITPIX out of {_BITS}, found {bits}")
    axes = _axes(cards, where)
    pcount, gcount = (
        _integer(cards, keyword, where) if keyword.encode() in cards else default
        for keyword, default in (("PCOUNT", 0), ("GCOUNT", 1))
    )
    if not axes:
        return 0
    # Random groups (old radio data) have NAXIS1 = 0, which is not a factor of the size.
    counted = axes[1:] if b"GROUPS" in cards and axes[0] == 0 else axes
    return abs(bits) // 8 * gcount * (pcount + math.prod(counted))


def _axes(cards: dict[bytes, bytes], where: str) -> list[int]:
    count = _integer(cards, "NAXIS", where, _MAX_AXES)
    return [_integer(cards, f"NAXIS{i}", where) for i in range(1, count + 1)]


def _check_table(cards: dict[bytes, bytes], where: str) -> None:
    _integer(cards, "TFIELDS", where, _MAX_AXES)
    axes = _axes(cards, where)
    if len(axes) != 2:
        raise InputError(f"{where}: expected NAXIS = 2 in a table, found {len(axes)}")
    width, rows = axes
    if rows > MAX_ROWS or width * rows > MAX_BYTES:
        raise InputError(
            f"{where}: expected at most {MAX_ROWS} rows and {MAX_BYTES} bytes, "
            f"found {rows} rows of {width} bytes"
        )


def _integer(
    cards: dict[bytes, bytes], keyword: str, where: str, largest: int | None = None
) -> int:
    card = cards.get(keyword.encode(), b"")
    matched = _INTEGER.match(card)
    value = int(matched[1]) if matched else None
    signed = keyword == "BITPIX"
    if value is None or (value < 0 and not signed) or (largest is not None and value > largest):
        limit = "" if largest is None else f" of at most {largest}"
        found = card.decode("ascii", "replace").strip(" =") or "none"
        raise InputError(f"{where}: expected an integer {keyword}{limit}, found {found}")
    return value
