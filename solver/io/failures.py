"""Failures of the reading libraries on damaged files, told as one `InputError`."""

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

# Measured by feeding the readers damaged files: they fail with whatever their own code
# trips over first, a KeyError for TFIELDS = 999 or a TypeError for NAXIS2 = 'abc'.
_RAISED_ON_DAMAGE = (
    ArithmeticError,
    ArrowException,
    AssertionError,
    AttributeError,
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
_LONGEST_REASON = 300


@contextmanager
def reading(where: str, expected: str) -> Iterator[None]:
    """Turn every failure of a reading library inside the block into an `InputError`.

    The libraries' warnings are silenced as well: what they warn of (a failed checksum, a
    short file, an unknown unit) is checked by the callers, who refuse it.

    Parameters
    ----------
    where : the file and the part of it that is read
    expected : what should be there, in words

    Raises
    ------
    InputError
        Naming `where`, `expected` and the library's reason.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            yield
        except InputError:
            raise
        except _RAISED_ON_DAMAGE as error:
            reason = " ".join(str(error).split())[:_LONGEST_REASON]
            raise InputError(
                f"{where}: expected {expected}, found {type(error).__name__}: {reason}"
            ) from error
