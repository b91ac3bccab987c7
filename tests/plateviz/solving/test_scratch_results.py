"""Results in a scratch folder: which stay, and which make room for others."""

from dataclasses import replace

import pytest

from plateviz.runs.scratch_result import write_scratch_result
from plateviz.solving import scratch_results
from plateviz.solving.scratch_results import ScratchResults


@pytest.fixture
def few(monkeypatch):
    """Few enough results that are kept in any case, and in memory, for a test."""
    monkeypatch.setattr(scratch_results, "_LEAST", 2)
    monkeypatch.setattr(scratch_results, "_MOST_READ", 1)


def written(results, folder, numbers, result):
    """Write some results, as after jobs; return the directories that made room for them."""
    removed = []
    for number in numbers:
        removed += results.expect(folder / str(number))
        write_scratch_result(folder / str(number), result)
    return [directory.name for directory in removed]


def size(directory):
    return sum(file.stat().st_size for file in directory.iterdir())


def test_what_was_used_longest_ago_is_removed(tmp_path, fit_result, few):
    (tmp_path / "first").mkdir()
    write_scratch_result(tmp_path / "first" / "0", fit_result)
    # Room for two beside the latest two.
    results = ScratchResults(lambda _: True, 2 * size(tmp_path / "first" / "0"))
    folder = tmp_path / "scratch"
    folder.mkdir()
    assert written(results, folder, range(4), fit_result) == []
    results.get(folder / "0")
    assert written(results, folder, [4, 5], fit_result) == ["1", "2"]
    assert results.get(folder / "1") is None
    assert results.get(folder / "0").sources.equals(fit_result.sources)
    # No part of one is left.
    assert sorted(one.name for one in folder.iterdir()) == ["0", "3", "4", "5"]


def test_what_a_page_shows_and_the_latest_stay(tmp_path, fit_result, few):
    results = ScratchResults(lambda _: True, 1)
    written(results, tmp_path, range(2), fit_result)
    shown = results.get(tmp_path / "0")
    assert written(results, tmp_path, range(2, 6), fit_result) == ["1", "2", "3"]
    assert (tmp_path / "0").is_dir()
    del shown
    # In place of the one that was read last.
    results.get(tmp_path / "5")
    assert written(results, tmp_path, [6, 7], fit_result) == ["0", "4"]


def test_what_is_being_computed_takes_no_room(tmp_path, fit_result, few):
    results = ScratchResults(lambda _: True, 1)
    assert [results.expect(tmp_path / str(number)) for number in range(5)] == [[]] * 5
    write_scratch_result(tmp_path / "0", replace(fit_result))
    assert results.expect(tmp_path / "5") == [tmp_path / "0"]


def test_file_that_is_renamed_while_sizes_are_counted_is_no_error(tmp_path, fit_result, few):
    results = ScratchResults(lambda _: True, 1)
    written(results, tmp_path, [0], fit_result)
    # As one that is listed and then gone.
    (tmp_path / "0" / "modes.part").symlink_to("gone")
    assert written(results, tmp_path, [1, 2], fit_result) == ["0"]
