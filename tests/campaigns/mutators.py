"""Mutations of a file's bytes: damage by disks and copies, and edits by hand.

Each takes a generator of random numbers and the bytes, and returns other bytes. The same state of
the generator gives the same bytes.
"""

import re
from collections.abc import Callable
from random import Random

Mutator = Callable[[Random, bytes], bytes]

_FITS_BLOCK = 2880
_CARD = 80
_BOUNDARIES = (512, 4096, _FITS_BLOCK)
_LONGEST_SPAN = 4000
_WORD = re.compile(rb"[\w.+-]+")
_QUOTED_OR_WORD = re.compile(rb'"[^"\n]*"|[\w.+-]+')

NUMBERS = (
    *(b"0", b"-1", b"1", b"2", b"7.5", b"-0.0", b"1e400", b"1e-400", b"1e300", b"nan", b"NaN"),
    *(b"inf", b"-Infinity", b"2147483648", b"9223372036854775807", b"9223372036854775808"),
    *(b"99999999999999999999", b"1000000000", b"20000001", b"9" * 400, b"9" * 5000),
    *(b"0x" + b"f" * 5000, b"0b1", b"1_000", b"1,5", b"+-3", b"1e", b"0o17", b"\xd9\xa3"),
)
WORDS = (
    *(b"", b" ", b"true", b"false", b"null", b"T", b"F", b"mas", b"deg", b"rad", b"um", b"pix"),
    *(b"km", b"mas/yr", b"mas.yr**-1", b"arcsec / yr", b"d", b"yr", b"kg", b"furlong", b"mag"),
    *(b"dB", b"-", b"int64", b"int8", b"uint64", b"float32", b"float16", b"complex128", b"bool"),
    *(b"string", b"object", b"double", b"char", b"unicodeChar", b"bit", b"short", b"*", b"3x2"),
    *(b"100000000*", b"1979-05-27T07:32:00Z", b"binary", b"base64", b"source_id", b"ra", b"dec"),
)
TEXTS = (
    *(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\r", b"\n", b'"', b"'", b"\\"),
    *(b"[" * 5000, b"{a=" * 3000, b"<a>" * 3000, b'{"a":' * 3000, b"- " * 2000, b"x" * 200_000),
    *(b"&a [*a, *a]", b"*nothing", b"&lt;", b"&lol;", b"<![CDATA[", b"-->", b"]]>", b"<!--", b"#"),
    *(b"!!python/object/apply:os.getcwd []", b"!numpy.ndarray", b"../../../etc/passwd", b"%00"),
    *(b"href='http://localhost/'", b"name", b"detector = 3", b"[detector]", b"\xe2\x80\xae", b"=,"),
)
TOKENS = (*NUMBERS, *WORDS, *TEXTS)

_STRUCTURAL = re.compile(
    rb"(SIMPLE|BITPIX|NAXIS\d*|EXTEND|XTENSION|PCOUNT|GCOUNT|TFIELDS|EXTNAME|T(FORM|TYPE|UNIT|NULL"
    rb"|SCAL|ZERO|DIM|DISP)\d+|CHECKSUM|DATASUM|FORMAT|ORIGIN|THEAP|END) *"
)
_CARD_VALUES = (
    *(b"0", b"-1", b"1", b"8", b"-64", b"16", b"32", b"999", b"1000", b"20000001"),
    *(
        b"1000000000",
        b"10000000000",
        b"9223372036854775807",
        b"9" * 60,
        b"1.5",
        b"1E400",
        b"NaN",
        b"T",
        b"F",
        b"",
        b"'abc     '",
    ),
    *(b"'1D      '", b"'1E      '", b"'1K      '", b"'K       '", b"'D       '", b"'L       '"),
    *(b"'X       '", b"'20A     '", b"'1M      '", b"'PD(5)   '", b"'QD(9999)'", b"'999999999D'"),
    *(b"'1J      '", b"'0D      '", b"'2D      '", b"'Z       '", b"'I       '", b"'B       '"),
    *(b"'mas     '", b"'deg     '", b"'rad     '", b"'um      '", b"'pix     '", b"'kg      '"),
    *(b"'mas yr-1'", b"'furlong '", b"'d       '", b"'(2,2)   '", b"'source_id'", b"'ra      '"),
    *(
        b"'BINTABLE'",
        b"'TABLE   '",
        b"'IMAGE   '",
        b"'measurement'",
        b"''",
        b"'unclosed",
        b"(1, 2)",
    ),
    *(b"'\x00\x01\xff'", b"'environment'", b"'RESULT  '", b"'0       '", b"'4294967295'"),
)
_NEW_CARDS = (
    *(b"TNULL1  = -1", b"TSCAL6  = 2.0", b"TZERO6  = 1000.0", b"TZERO1  = 9223372036854775808"),
    *(b"TDIM6   = '(2,2)   '", b"INHERIT = T", b"GROUPS  = T", b"ZIMAGE  = T", b"ZTABLE  = T"),
    *(b"THEAP   = 10", b"CONTINUE  'abc'", b"HIERARCH a b = 1", b"BLANK   = 0", b"BSCALE  = 2.0"),
    *(b"MJDREF  = 51544.0", b"TCTYP4  = 'UTC'", b"TIMESYS = 'UTC'", b"TUNIT5  = 'mas'", b"END"),
)


def mutate(random: Random, content: bytes, mutators: tuple[Mutator, ...]) -> bytes:
    """Return other bytes: one mutation three times in four, else up to four of them."""
    count = 1 if random.random() < 0.75 else random.randint(2, 4)
    changed = content
    for _ in range(count):
        changed = random.choice(mutators)(random, changed)
    # What two mutations undo, or a span that is replaced by itself, would test nothing.
    return changed if changed != content else flip_bits(random, content)


def flip_bits(random: Random, content: bytes) -> bytes:
    changed = bytearray(content or b"\0")
    for _ in range(random.choice((1, 1, 1, 2, 8))):
        changed[_place(random, len(changed) - 1)] ^= 1 << random.randrange(8)
    return bytes(changed)


def set_bytes(random: Random, content: bytes) -> bytes:
    start, stop = _span(random, content, 16)
    return content[:start] + random.randbytes(stop - start) + content[stop:]


def truncate(random: Random, content: bytes) -> bytes:
    size = _place(random, len(content))
    if random.random() < 0.5:
        size -= size % random.choice(_BOUNDARIES)
    return content[:size]


def delete_span(random: Random, content: bytes) -> bytes:
    start, stop = _span(random, content)
    return content[:start] + content[stop:]


def insert_bytes(random: Random, content: bytes) -> bytes:
    place = _place(random, len(content))
    return content[:place] + random.randbytes(random.randint(1, 64)) + content[place:]


def duplicate_span(random: Random, content: bytes) -> bytes:
    start, stop = _span(random, content)
    place = random.choice((stop, _place(random, len(content))))
    return content[:place] + content[start:stop] + content[place:]


def fill_with_zeros(random: Random, content: bytes) -> bytes:
    start, stop = _span(random, content)
    if random.random() < 0.5:
        start -= start % 512
        stop = min(start + 512 * random.randint(1, 8), len(content))
    return content[:start] + bytes(stop - start) + content[stop:]


def overwrite_span(random: Random, content: bytes) -> bytes:
    start, stop = _span(random, content)
    source = _place(random, len(content))
    return content[:start] + content[source : source + stop - start] + content[stop:]


def append_bytes(random: Random, content: bytes) -> bytes:
    return content + random.choice((bytes(2880), b"\n", random.randbytes(100), content))


def replace_word(random: Random, content: bytes) -> bytes:
    """Put a hostile token, or another word of the file, where a word is."""
    words = list(random.choice((_WORD, _QUOTED_OR_WORD)).finditer(content))
    if not words:
        return insert_token(random, content)
    chosen = random.choice(words)
    new = random.choice(words)[0] if random.random() < 0.2 else random.choice(TOKENS)
    if chosen[0].startswith(b'"') and random.random() < 0.7:
        new = b'"' + new + b'"'
    return content[: chosen.start()] + new + content[chosen.end() :]


def replace_number(random: Random, content: bytes) -> bytes:
    """Put another number where a number is, everywhere once in ten times."""
    numbers = list(re.finditer(rb"(?<![\w.])[+-]?\d[\d.eE+-]*", content))
    if not numbers:
        return insert_token(random, content)
    chosen, new = random.choice(numbers), random.choice(NUMBERS)
    if random.random() < 0.1 and len(new) < 50:
        return content.replace(chosen[0], new)
    return content[: chosen.start()] + new + content[chosen.end() :]


def insert_token(random: Random, content: bytes) -> bytes:
    place = _place(random, len(content))
    return content[:place] + random.choice(TOKENS) + content[place:]


def move_lines(random: Random, content: bytes) -> bytes:
    """Delete, duplicate or exchange lines, or end them in another way."""
    lines = content.split(b"\n")
    first, second = (random.randrange(len(lines)) for _ in range(2))
    what = random.randrange(5)
    if what == 0:
        del lines[first]
    elif what == 1:
        lines.insert(second, lines[first])
    elif what == 2:
        lines[first], lines[second] = lines[second], lines[first]
    elif what == 3:
        return content.replace(b"\n", random.choice((b"\r\n", b"\r", b"\n\n")))
    else:
        return content.replace(b",", random.choice((b";", b"\t", b" ", b",,")))
    return b"\n".join(lines)


def change_card(random: Random, content: bytes) -> bytes:
    """Give a card of a FITS header another value, keyword or place."""
    places = list(_cards(content))
    structural = [place for place in places if _STRUCTURAL.match(content[place : place + 8])]
    if not places:
        return flip_bits(random, content)
    first = random.choice(structural if structural and random.random() < 0.8 else places)
    second = random.choice(places)
    card, other = content[first : first + _CARD], content[second : second + _CARD]
    what = random.randrange(10)
    if what < 5:
        return _with_card(content, first, card[:8] + b"= " + random.choice(_CARD_VALUES).rjust(20))
    if what == 5:
        return _with_card(content, first, card[:8] + other[8:])
    if what == 6:
        return _with_card(content, first, other[:8] + card[8:])
    if what == 7:
        return _with_card(_with_card(content, first, other), second, card)
    if what == 8:
        return _with_card(content, first, b"COMMENT removed")
    return _with_card(content, first, random.choice(_NEW_CARDS))


def move_hdus(random: Random, content: bytes) -> bytes:
    """Delete, duplicate or exchange whole HDUs of a FITS file."""
    starts = [*_hdus(content), len(content)]
    hdus = [content[a:b] for a, b in zip(starts, starts[1:], strict=False)]
    if len(hdus) < 2:
        return truncate(random, content)
    first, second = (random.randrange(len(hdus)) for _ in range(2))
    what = random.randrange(4)
    if what == 0:
        del hdus[first]
    elif what == 1:
        del hdus[max(first, 1) :]
    elif what == 2:
        hdus.insert(second, hdus[first])
    else:
        hdus[first], hdus[second] = hdus[second], hdus[first]
    return b"".join(hdus)


DAMAGE: tuple[Mutator, ...] = (
    *(flip_bits, flip_bits, flip_bits, set_bytes, truncate, delete_span, insert_bytes),
    *(duplicate_span, fill_with_zeros, overwrite_span, append_bytes),
)
EDITS: tuple[Mutator, ...] = (replace_word, replace_number, insert_token, move_lines)
TEXT: tuple[Mutator, ...] = (*DAMAGE, *EDITS, *EDITS, *EDITS)
FITS: tuple[Mutator, ...] = (*DAMAGE, *(change_card,) * 10, *(move_hdus,) * 3)


def has_checksums(content: bytes) -> bool:
    """Return whether every HDU of a FITS file has the cards of its checksums."""
    keywords = [content[place : place + 8] for place in _cards(content)]
    wanted = len(_hdus(content))
    return all(keywords.count(name) >= wanted for name in (b"CHECKSUM", b"DATASUM "))


def _place(random: Random, size: int) -> int:
    """Return a place in a file, more often near its ends, where headers and footers are."""
    size = max(size, 0)
    end = random.choice((size, size, min(size, 1500), None))
    return random.randint(max(0, size - 1500), size) if end is None else random.randint(0, end)


def _span(random: Random, content: bytes, longest: int = _LONGEST_SPAN) -> tuple[int, int]:
    start = _place(random, len(content))
    return start, min(start + random.randint(1, random.choice((8, longest))), len(content))


def _with_card(content: bytes, place: int, card: bytes) -> bytes:
    return content[:place] + card[:_CARD].ljust(_CARD) + content[place + _CARD :]


def _hdus(content: bytes) -> list[int]:
    blocks = range(0, len(content), _FITS_BLOCK)
    return [b for b in blocks if content[b : b + 9] in (b"SIMPLE  =", b"XTENSION=")]


def _cards(content: bytes) -> list[int]:
    """Return where the cards of all headers are."""
    found = []
    for start in _hdus(content):
        for place in range(start, len(content), _CARD):
            found.append(place)
            if content[place : place + 8] == b"END     ":
                break
    return found
