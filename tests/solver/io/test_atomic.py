"""Atomic writing: a complete file or none, and checks before the work."""

import hashlib
import os

import pytest

from solver.errors import DiskError, InputError
from solver.io.atomic import require_writable, sha256_of, write_atomically


def test_write_atomically_puts_the_file_in_place(tmp_path):
    target = tmp_path / "out.txt"
    with write_atomically(target) as temporary:
        temporary.write_text("whole")
        assert not target.exists()
    assert target.read_text() == "whole"
    assert os.listdir(tmp_path) == ["out.txt"]


def test_temporary_lies_beside_the_target_with_its_suffix(tmp_path):
    with write_atomically(tmp_path / "out.parquet") as temporary:
        assert temporary.parent.parent == tmp_path
        assert temporary.suffix == ".parquet"


def _write_half(target, error):
    with write_atomically(target) as temporary:
        temporary.write_text("half")
        raise error


def test_interrupted_write_leaves_no_file(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        _write_half(tmp_path / "out.txt", KeyboardInterrupt())
    assert os.listdir(tmp_path) == []


def test_interrupted_write_keeps_the_old_file(tmp_path):
    target = tmp_path / "out.txt"
    target.write_text("old")
    with pytest.raises(RuntimeError, match="no more"):
        _write_half(target, RuntimeError("no more"))
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["out.txt"]


def test_full_disk_is_an_input_error_and_leaves_no_file(tmp_path):
    with pytest.raises(DiskError, match=r"out\.txt: expected to write.*full disk .* free"):
        _write_half(tmp_path / "out.txt", OSError(28, "No space left on device"))
    assert os.listdir(tmp_path) == []


def test_missing_folder_is_refused_before_the_block(tmp_path):
    entered = []
    with (
        pytest.raises(InputError, match="found no folder"),
        write_atomically(tmp_path / "none" / "out.txt") as temporary,
    ):
        entered.append(temporary)
    assert not entered


def test_read_only_folder_is_refused(tmp_path, monkeypatch):
    # The superuser may write anywhere, so the answer of the system is replaced.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(InputError, match="read-only"):
        require_writable(tmp_path / "out.txt")


def test_folder_as_target_is_refused(tmp_path):
    with pytest.raises(InputError, match="not a file"):
        require_writable(tmp_path)


@pytest.mark.skipif(not os.path.exists("/dev/null"), reason="no device files on this system")
def test_device_as_target_is_refused():
    with pytest.raises(InputError, match="not a file"):
        require_writable("/dev/null")


def test_link_is_followed(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    with write_atomically(tmp_path / "link.txt") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


def test_sha256_of(tmp_path):
    (tmp_path / "a").write_bytes(b"plate")
    assert sha256_of(tmp_path / "a") == hashlib.sha256(b"plate").hexdigest()


def test_sha256_of_missing_file(tmp_path):
    with pytest.raises(InputError, match="expected a readable file"):
        sha256_of(tmp_path / "a")


def test_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe: expected a file, found something that is not"):
        sha256_of(tmp_path / "pipe")
