"""Conversion of library exceptions on damaged files to `InputError`."""

import csv
import re
import struct
import warnings
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from xml.parsers.expat import ExpatError

from astropy.io.fits import VerifyError
from astropy.table.meta import YamlParseError
from pyarrow import ArrowException

from solver.errors import InputError

# Found by reading damaged files. The libraries raise whatever fails first in their own code,
# such as KeyError for TFIELDS = 999 or TypeError for NAXIS2 = 'abc'.
_RAISED_ON_DAMAGE = (
    ArithmeticError,
    ArrowException,
    AssertionError,
    AttributeError,
    csv.Error,
    EOFError,
    ExpatError,
    LookupError,
    MemoryError,
    NameError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    VerifyError,
    YamlParseError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
# Raised by code that did not foresee the damage: a message such as "'NoneType' object is not
# subscriptable" does not describe the file.
_UNFORESEEN = (ArithmeticError, AssertionError, AttributeError, LookupError, NameError, TypeError)
# The name of an exception in the message of another one, or the number of an error of the system.
_EXCEPTION = re.compile(r"\b\w*(?:Error|Exception): |^\[Errno \d+\] ")
_MAX_REASON_LENGTH = 300


@contextmanager
def reading(where: str, expected: str) -> Iterator[None]:
    """Convert exceptions of a reading library inside the block to `InputError`.

    Warnings of the libraries are silenced. The callers check what these would report, such as
    a wrong checksum, a truncated file or an unknown unit.

    Parameters
    ----------
    where : the file, and the part of it that is read
    expected : text that describes the expected content

    Raises
    ------
    InputError
        With `where`, `expected` and what the library found, in words.
    """
    with warnings.catch_warnings(), refusing(where, expected):
        warnings.simplefilter("ignore")
        yield


@contextmanager
def refusing(where: str, expected: str) -> Iterator[None]:
    """Convert exceptions as `reading` does, with the warnings as they are.

    Warnings are silenced for all threads of a process at once, so that a thread beside others must
    not silence them.
    """
    try:
        yield
    except InputError:
        raise
    except _RAISED_ON_DAMAGE as error:
        raise InputError(f"{where}: expected {expected}, found {reason_of(error)}") from error


def reason_of(error: Exception) -> str:
    """Return what a library found, in one line, without names of exceptions."""
    if isinstance(error, MemoryError):
        return "a size that does not fit into the memory"
    first_paragraph = str(error).strip().partition("\n\n")[0]
    reason = " ".join(_EXCEPTION.sub("", first_paragraph).split())[:_MAX_REASON_LENGTH]
    if isinstance(error, _UNFORESEEN) or not reason:
        return f"damaged contents ({reason})" if reason else "damaged contents"
    return reason
