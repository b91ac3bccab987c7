"""A disk that takes no file is told in words: what is full, and what to do."""

import errno

import pytest

from solver.errors import DiskError, InputError
from solver.io.disk import disk_error, size_text, writing


def fail(path, error):
    with writing(path):
        raise error


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, r"found a full disk \(.* of .* free in .*\); free some space"),
        (errno.EDQUOT, "found your disk quota used up .*; free some space"),
        (errno.EFBIG, "found a lower limit on the size of a file; raise"),
        (errno.EROFS, "found a read-only disk; choose another folder"),
        (errno.EACCES, "found no permission to write there; choose another folder"),
        (errno.EIO, "found a disk that fails"),
    ],
)
def test_reason_is_told_in_words(tmp_path, number, words):
    with pytest.raises(DiskError, match=rf"out\.fits: expected to write the file, {words}"):
        fail(tmp_path / "none" / "out.fits", OSError(number, "the system's words"))


def test_reason_is_found_behind_the_error_of_a_library(tmp_path):
    error = OSError("astropy's words")
    error.__context__ = OSError(errno.ENOSPC, "No space left on device")
    assert "a full disk" in str(disk_error(error, tmp_path))
    assert disk_error(OSError("astropy's words"), tmp_path) is None


def test_full_disk_is_found_where_numpy_does_not_name_it(tmp_path):
    error = OSError("Not enough space. 65504 requested and 26560 written")
    assert "a full disk" in str(disk_error(error, tmp_path))


def test_other_errors_are_no_errors_of_the_disk(tmp_path):
    with pytest.raises(InputError, match="found: File exists$") as raised:
        fail(tmp_path, FileExistsError(errno.EEXIST, "File exists", ".out.fits-06ca7586a676.part"))
    assert not isinstance(raised.value, DiskError)


@pytest.mark.parametrize(
    ("size", "text"), [(0, "0.0 kB"), (2_500_000, "2.5 MB"), (7.31e10, "73.1 GB")]
)
def test_size_is_told_in_a_fitting_unit(size, text):
    assert size_text(size) == text
