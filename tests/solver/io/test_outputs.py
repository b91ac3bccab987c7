"""Checks of files to be written."""

from dataclasses import replace

import pytest

from solver.errors import InputError
from solver.io.atomic import sha256_of, write_atomically
from solver.io.outputs import check_output
from solver.io.result import write_result
from tests.solver.io_samples import small_result


def test_new_file_is_accepted_and_nothing_written(tmp_path):
    check_output(tmp_path / "a.fits", (".fits",), [tmp_path / "b.fits", tmp_path / "none"])
    assert list(tmp_path.iterdir()) == []


def test_input_that_does_not_exist_yet_is_refused_by_its_name(tmp_path):
    (tmp_path / "sub").mkdir()
    with pytest.raises(InputError, match="expected another file than the inputs"):
        check_output(tmp_path / "a.fits", (), [tmp_path / "sub" / ".." / "a.fits"])


def test_suffix_may_have_capitals(tmp_path):
    check_output(tmp_path / "A.FITS", (".fits",))


def test_file_that_appears_during_the_work_is_kept(tmp_path):
    target = tmp_path / "a.txt"

    def write_while_another_does():
        with write_atomically(target, overwrite=False) as temporary:
            temporary.write_text("mine")
            target.write_text("yours")

    with pytest.raises(InputError, match="expected to write the file, found: .*exists"):
        write_while_another_does()
    assert target.read_text() == "yours"
    assert list(tmp_path.iterdir()) == [target]


def test_new_file_is_written_where_links_are_unknown(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError("no links here")

    monkeypatch.setattr("os.link", refuse)
    with write_atomically(tmp_path / "a.txt", overwrite=False) as temporary:
        temporary.write_text("mine")
    assert (tmp_path / "a.txt").read_text() == "mine"


def test_result_never_replaces_a_copy_of_its_input(tmp_path):
    """Whatever it is called now, and even if overwriting is asked for."""
    path = tmp_path / "renamed.fits"
    path.write_bytes(b"measurements")
    result = replace(small_result(), provenance={"obs.fits": sha256_of(path)})
    with pytest.raises(InputError, match="expected another file than the inputs"):
        write_result(result, path, overwrite=True)
    assert path.read_bytes() == b"measurements"


def test_result_is_replaced_only_on_request(tmp_path):
    path = tmp_path / "r.fits"
    write_result(small_result(), path)
    with pytest.raises(InputError, match="expected a new file"):
        write_result(small_result(), path)
    write_result(small_result(), path, overwrite=True)
