"""Scratch folders: of one process, and removed when it has ended, however it ended."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from solver.errors import DiskError
from solver.io.atomic import write_atomically
from solver.io.scratch import ScratchFolder, is_scratch, remove_abandoned, temporary_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals and locks")

REPOSITORY = Path(__file__).resolve().parents[3]
HALF = (
    "import sys, time\n"
    "from solver.io.atomic import write_atomically\n"
    "with write_atomically(sys.argv[1]) as temporary:\n"
    "    temporary.write_text('half')\n"
    "    print('half', flush=True)\n"
    "    time.sleep(60)\n"
)


@pytest.fixture
def writer(tmp_path):
    """A process that has written the half of a file."""
    command = [sys.executable, "-c", HALF, str(tmp_path / "out.txt")]
    process = subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "half\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def killed(process):
    process.send_signal(signal.SIGKILL)
    process.wait()


def test_folder_is_removed_when_it_is_closed(tmp_path):
    with ScratchFolder(tmp_path, "some") as scratch:
        (scratch.path / "a").write_text("a")
        assert is_scratch(scratch.path.name, "some")
        assert not is_scratch(scratch.path.name, "som")
    assert names(tmp_path) == []


def test_next_writer_of_a_file_removes_what_a_killed_one_left(writer, tmp_path):
    killed(writer)
    assert len(names(tmp_path)) == 1
    with write_atomically(tmp_path / "other.txt"):
        pass
    assert len(names(tmp_path)) == 2
    with write_atomically(tmp_path / "out.txt") as temporary:
        temporary.write_text("whole")
    assert names(tmp_path) == ["other.txt", "out.txt"]


@pytest.mark.usefixtures("writer")
def test_folder_of_a_living_process_is_kept(tmp_path):
    before = names(tmp_path)
    with write_atomically(tmp_path / "out.txt") as temporary:
        temporary.write_text("whole")
    remove_abandoned(tmp_path)
    assert names(tmp_path) == [*before, "out.txt"]


def test_folder_that_a_process_had_not_locked_is_removed(tmp_path):
    (tmp_path / ".a-0123456789ab.part").mkdir()
    remove_abandoned(tmp_path)
    assert names(tmp_path) == []


def test_other_folders_files_and_links_are_kept(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "a-0123456789ab.part").write_text("a file")
    (tmp_path / "b-0123456789ab.part").symlink_to(tmp_path / "mine")
    (tmp_path / "c-012.part").mkdir()
    before = names(tmp_path)
    remove_abandoned(tmp_path)
    assert names(tmp_path) == before


def test_folder_of_another_person_is_kept(tmp_path, monkeypatch):
    (tmp_path / "a-0123456789ab.part").mkdir()
    monkeypatch.setattr(os, "geteuid", lambda: 54321)
    remove_abandoned(tmp_path)
    assert names(tmp_path) == ["a-0123456789ab.part"]


def test_nothing_is_removed_where_there_are_no_locks(tmp_path, monkeypatch):
    (tmp_path / "a-0123456789ab.part").mkdir()
    monkeypatch.setattr("solver.io.scratch.lock", lambda *_, **__: None)
    remove_abandoned(tmp_path)
    assert names(tmp_path) == ["a-0123456789ab.part"]


def test_missing_folder_has_nothing_abandoned(tmp_path):
    remove_abandoned(tmp_path / "none")


def test_no_folder_for_temporary_files_is_told(monkeypatch):
    def refuse():
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr("tempfile.gettempdir", refuse)
    with pytest.raises(DiskError, match=r"free some space, or let .*TMPDIR name another"):
        temporary_folder()
