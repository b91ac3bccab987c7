"""Results between two processes: whole or absent, and the same to the last bit."""

import errno
import json
from dataclasses import replace

import pandas as pd
import pytest

from plateviz.runs import scratch_result
from plateviz.runs.fitted_orbit import read_fitted_orbit, write_fitted_orbit
from plateviz.runs.scratch_result import (
    are_eigenmodes_to_come,
    is_judged_later,
    is_written,
    read_scratch_result,
    request_eigenmodes,
    request_late_verdict,
    write_eigenmodes,
    write_scratch_result,
    write_verdict,
)
from plateviz.verdict.verdict import with_verdict
from solver.data.eigenmode_schema import EIGENMODE_TABLES
from solver.data.schema import RESULT_TABLES
from solver.errors import DiskError, InputError

EIGENMODES = [table.name for table in EIGENMODE_TABLES]


def same(before, after):
    for table in RESULT_TABLES:
        one, other = getattr(before, table.name), getattr(after, table.name)
        assert (one is None) == (other is None), table.name
        if one is not None:
            pd.testing.assert_frame_equal(
                one.reset_index(drop=True), other, check_exact=True, obj=table.name
            )
    assert after.settings == before.settings
    assert after.summary == json.loads(json.dumps(before.summary))
    assert after.provenance == before.provenance


def without_eigenmodes(result):
    return replace(result, **dict.fromkeys(EIGENMODES))


def test_result_is_the_same_to_the_last_bit(fit_result, compared, tmp_path):
    for number, result in enumerate((fit_result, compared)):
        write_scratch_result(tmp_path / f"{number}", result)
        same(result, read_scratch_result(tmp_path / f"{number}"))


def test_result_that_is_kept_has_all_tables(fit_result, tmp_path):
    write_scratch_result(tmp_path / "scratch", fit_result)
    write_fitted_orbit(tmp_path / "kept", read_scratch_result(tmp_path / "scratch"))
    kept = read_fitted_orbit(tmp_path / "kept")
    same(fit_result, replace(kept, trace=kept.trace.astype(fit_result.trace.dtypes)))


def test_result_is_read_after_its_folder_was_removed(fit_result, tmp_path):
    """As when a server removes its scratch folder while a page draws."""
    write_scratch_result(tmp_path / "result", fit_result)
    back = read_scratch_result(tmp_path / "result")
    for path in (tmp_path / "result").iterdir():
        path.unlink()
    same(fit_result, back)


def test_half_written_result_is_never_read(fit_result, tmp_path, monkeypatch):
    written, write = [], scratch_result.write_scratch_table

    def write_two(path, frame):
        assert not is_written(tmp_path / "result")
        if len(written) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(path)
        write(path, frame)

    monkeypatch.setattr(scratch_result, "write_scratch_table", write_two)
    with pytest.raises(DiskError, match="expected to write the result of a fit, found a full disk"):
        write_scratch_result(tmp_path / "result", fit_result)
    assert len(written) == 2
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match="expected the result of a fit"):
        read_scratch_result(tmp_path / "result")


def test_existing_result_is_not_changed(fit_result, make_fit_result, tmp_path):
    write_scratch_result(tmp_path / "result", fit_result)
    write_scratch_result(tmp_path / "result", make_fit_result(2)[0])
    same(fit_result, read_scratch_result(tmp_path / "result"))
    assert [path.name for path in tmp_path.iterdir()] == ["result"]


@pytest.fixture
def partial(fit_result, tmp_path):
    """A result whose eigenmodes are to follow; and the function that writes them."""
    write_scratch_result(tmp_path / "partial", without_eigenmodes(fit_result), is_partial=True)

    def finish():
        tables = {name: getattr(fit_result, name) for name in EIGENMODES}
        write_eigenmodes(tmp_path / "partial", tables)
        return True

    return tmp_path / "partial", finish


def test_eigenmodes_that_follow_are_the_same(fit_result, partial):
    directory, finish = partial
    early = read_scratch_result(directory)
    assert early.sources.equals(fit_result.sources)
    finish()
    same(fit_result, early)
    same(fit_result, read_scratch_result(directory))


def test_who_uses_eigenmodes_asks_for_them_once(fit_result, partial):
    directory, finish = partial
    asked = []
    result = read_scratch_result(directory, complete=lambda part: asked.append(part) or finish())
    # A widget with solutions to choose from makes a text of each.
    assert repr(result) == f"<FitResult of orbit {fit_result.orbit_id}: order 5>"
    assert not asked
    # As `keep` and every export do: all fields are read.
    same(fit_result, replace(result))
    assert asked == ["eigenmodes"]


def test_question_whether_eigenmodes_are_to_come_requests_none(partial):
    directory, finish = partial
    asked = []
    result = read_scratch_result(directory, complete=lambda part: asked.append(part) or True)
    assert are_eigenmodes_to_come(result)
    assert not asked
    finish()
    assert not are_eigenmodes_to_come(result)


def test_eigenmodes_that_never_come_are_an_error_at_once(partial):
    result = read_scratch_result(partial[0], complete=lambda _: False)
    for name in EIGENMODES:
        with pytest.raises(InputError, match="the solver ended or had no time to write them"):
            getattr(result, name)
    assert len(result.sources)


def test_page_that_has_given_up_does_not_wait_again(partial, monkeypatch):
    monkeypatch.setattr(scratch_result, "_PATIENCE_OF_PAGE", 0.0)
    monkeypatch.setattr(scratch_result.time, "sleep", lambda _: pytest.fail("waited"))
    asked = []
    result = read_scratch_result(partial[0], complete=lambda part: asked.append(part) or True)
    request_eigenmodes(result)
    assert not are_eigenmodes_to_come(result)
    with pytest.raises(InputError, match="had no time"):
        result.eigenmodes.head()
    assert asked == ["eigenmodes"]
    monkeypatch.setattr(scratch_result, "_PATIENCE_OF_PAGE", 60.0)
    request_eigenmodes(result)
    assert are_eigenmodes_to_come(result)
    assert asked == ["eigenmodes", "eigenmodes"]


@pytest.fixture
def unjudged(fit_result, tmp_path):
    """A result whose verdict is to follow; the same with it; and the function that writes it."""
    judged = with_verdict(fit_result)
    write_scratch_result(tmp_path / "unjudged", fit_result, is_judged=False)

    def finish():
        write_verdict(tmp_path / "unjudged", judged.summary["verdict"])
        return True

    return tmp_path / "unjudged", judged, finish


def test_verdict_that_follows_is_the_same(unjudged):
    directory, judged, finish = unjudged
    early = read_scratch_result(directory)
    assert early.summary["converged"]
    assert is_judged_later(early)
    finish()
    assert not is_judged_later(early)
    for result in (early, read_scratch_result(directory)):
        same(judged, result)
        assert len(result.summary) == len(judged.summary)


@pytest.mark.parametrize(
    "use", [dict, len, lambda summary: summary.get("verdict")], ids=["all", "number", "verdict"]
)
def test_who_uses_the_verdict_waits_for_it(unjudged, use):
    directory, judged, finish = unjudged
    asked = []
    result = read_scratch_result(directory, complete=lambda part: asked.append(part) or finish())
    assert result.summary["engine"] == judged.summary["engine"]
    assert not asked
    assert use(result.summary) == use(json.loads(json.dumps(judged.summary)))
    assert use(result.summary)
    assert asked == ["verdict"]


def test_result_whose_verdict_never_comes_has_none(fit_result, unjudged):
    result = read_scratch_result(unjudged[0], complete=lambda _: False)
    assert result.summary.get("verdict") is None
    assert not is_judged_later(result)
    same(fit_result, result)


def test_page_asks_once_for_a_verdict_that_is_late(unjudged, monkeypatch):
    asked = []
    result = read_scratch_result(unjudged[0], complete=lambda part: asked.append(part) or True)
    request_late_verdict(result)
    assert is_judged_later(result)
    assert not asked
    monkeypatch.setattr(scratch_result, "_LATE_SECONDS", 0.0)
    result = read_scratch_result(unjudged[0], complete=lambda part: asked.append(part) or True)
    assert is_judged_later(result)
    assert not asked
    request_late_verdict(result)
    request_late_verdict(result)
    assert is_judged_later(result)
    assert asked == ["verdict"]


def test_overdue_verdict_is_not_waited_for_again(unjudged, monkeypatch):
    monkeypatch.setattr(scratch_result, "_PATIENCE_SECONDS", 0.0)
    result = read_scratch_result(unjudged[0])
    assert "verdict" not in result.summary
    assert not is_judged_later(result)
    monkeypatch.setattr(scratch_result.time, "sleep", lambda _: pytest.fail("waited"))
    assert result.summary.get("verdict") is None
