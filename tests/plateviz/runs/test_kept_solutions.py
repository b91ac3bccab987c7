"""Kept solutions: copied whole under a name that is free, and read back; notes beside them."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

import plateviz
from plateviz.runs.kept_solutions import KeptSolutions, kept_solution
from plateviz.runs.note import MOST_BYTES, NoteChangedError, read_note, write_note
from solver.data.instrument import MINI_MOCK
from solver.errors import InputError


@pytest.fixture
def kept(tmp_path):
    return KeptSolutions(tmp_path / "solutions")


def test_kept_solution_is_read_back(kept, fit_result):
    assert kept.all() == []
    made = kept.keep("lower-order", 3, True, fit_result)
    assert kept.all() == [made] == [kept.find("lower-order")]
    assert (made.name, made.orbit, made.is_what_if) == ("lower-order", 3, True)
    assert made.settings() == fit_result.settings
    assert made.read().sources.equals(fit_result.sources)
    assert kept.keep("of-files", None, False, fit_result).directory.name == "orbit=file"
    assert [one.orbit for one in kept.all()] == [3, None]


def test_solution_of_another_instrument_is_refused(kept, fit_result):
    made = kept.keep("a", None, False, fit_result)
    assert kept.read(made).instrument == fit_result.instrument
    other = KeptSolutions(kept.folder, replace(MINI_MOCK, focal_length_um=2e6))
    with pytest.raises(InputError, match="kept solution 'a': expected a solution with the"):
        other.read(other.find("a"))


def test_name_that_is_taken_changes_nothing(kept, fit_result):
    kept.keep("a", 3, False, fit_result)
    with pytest.raises(InputError, match="a name that is free, found a kept solution 'a'"):
        kept.keep("a", 4, False, fit_result)
    assert [one.orbit for one in kept.all()] == [3]


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "../a", "-a", "a" * 61, "a b", "\x00", "é"])
def test_invalid_name_is_refused(kept, fit_result, name):
    with pytest.raises(InputError, match="expected a name of up to 60 letters"):
        kept.keep(name, 3, False, fit_result)
    with pytest.raises(InputError, match="expected the name of a kept solution"):
        kept.find(name)
    assert not kept.folder.exists()


def test_too_many_are_refused(kept, fit_result, monkeypatch):
    monkeypatch.setattr("plateviz.runs.kept_solutions.MOST", 1)
    kept.keep("a", 3, False, fit_result)
    with pytest.raises(InputError, match="1 solutions are kept; remove some first"):
        kept.keep("b", 3, False, fit_result)


def test_folder_that_is_no_solution_is_none(kept, fit_result):
    made = kept.keep("a", 3, False, fit_result)
    (kept.folder / "empty").mkdir()
    (kept.folder / "file.txt").write_text("text")
    (made.directory / "COMPLETE").unlink()
    assert kept.all() == []
    assert kept_solution(kept.folder) is None


def test_kept_solution_is_opened_in_a_notebook_and_reported(kept, fit_result, run, few_figures):
    made = kept.keep("lower", 3, False, fit_result)
    opened = plateviz.open(made.directory.parent)
    assert len(opened.result.sources) == len(made.read().sources)
    output = kept.folder.parent / "report.html"
    code, printed, error = run("report", made.directory.parent, "-o", output)
    assert code == 0, error
    assert str(output) in printed
    code, _, error = run("report", made.directory.parent, "--orbit", "3", "-o", "other.html")
    assert code == 2
    assert "found a kept solution" in error


def test_note_is_written_and_read(tmp_path):
    path = tmp_path / "note.txt"
    empty = read_note(path)
    assert empty.text == ""
    note = write_note(path, "  <b>bold</b>\r\nµ\x00\u202e ", empty.version)
    assert note == read_note(path)
    assert note.text == "<b>bold</b>\nµ"


@pytest.mark.parametrize("text", ["σ = 3\u00a0mas", "良い\u3000解", "👩\u200d🚀"])
def test_note_keeps_spaces_and_joiners_of_all_scripts(tmp_path, text):
    assert (
        write_note(tmp_path / "note.txt", text, read_note(tmp_path / "note.txt").version).text
        == text
    )


def test_second_of_two_people_is_told_and_loses_nothing(tmp_path):
    path = tmp_path / "note.txt"
    before = read_note(path)
    write_note(path, "mine", before.version)
    with pytest.raises(NoteChangedError, match="somebody else has changed this note") as refused:
        write_note(path, "theirs", before.version)
    assert read_note(path).text == "mine" == refused.value.note.text
    assert write_note(path, "mine and theirs", refused.value.note.version).text == "mine and theirs"


def test_three_people_at_once_lose_nothing(tmp_path):
    path = tmp_path / "note.txt"

    def write_lines(person):
        for number in range(20):
            note = read_note(path)
            while True:
                try:
                    write_note(path, f"{note.text}\n{person}{number}", note.version)
                except NoteChangedError as error:
                    note = error.note
                else:
                    break

    with ThreadPoolExecutor(3) as threads:
        list(threads.map(write_lines, "abc"))
    lines = read_note(path).text.split()
    assert sorted(lines) == sorted(f"{person}{number}" for person in "abc" for number in range(20))


@pytest.mark.parametrize(
    ("content", "told"),
    [(b"\xff\xfe", "a note"), (b"x" * (MOST_BYTES + 1), "bytes or fewer")],
    ids=["binary", "long"],
)
def test_file_that_is_no_note_is_refused_and_stays(tmp_path, content, told):
    path = tmp_path / "note.txt"
    version = read_note(path).version
    path.write_bytes(content)
    with pytest.raises(InputError, match=told):
        read_note(path)
    with pytest.raises(InputError, match=told):
        write_note(path, "new", version)
    assert path.read_bytes() == content


def test_note_that_is_too_long_or_has_no_place_is_refused(tmp_path):
    version = read_note(tmp_path / "note.txt").version
    with pytest.raises(InputError, match="8,000 bytes or fewer, found 16,000"):
        write_note(tmp_path / "note.txt", "µ" * MOST_BYTES, version)
    with pytest.raises(InputError, match="expected the directory of the note"):
        write_note(tmp_path / "gone" / "note.txt", "text", version)
    assert not (tmp_path / "note.txt").exists()
