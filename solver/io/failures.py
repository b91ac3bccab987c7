"""Conversion of library exceptions on damaged files to `InputError`."""

import csv
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
        With `where`, `expected` and the message of the library.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            yield
        except InputError:
            raise
        except _RAISED_ON_DAMAGE as error:
            reason = " ".join(str(error).split())[:_MAX_REASON_LENGTH]
            raise InputError(
                f"{where}: expected {expected}, found {type(error).__name__}: {reason}"
            ) from error
