"""Solutions are judged in another thread, once for all pages."""

import gc
import weakref
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from plateviz.runs import scratch_result
from plateviz.runs.scratch_result import (
    read_scratch_result,
    write_scratch_result,
    write_verdict,
)
from plateviz.solving.judge import Judge
from plateviz.verdict.verdict import is_judged, orbit_verdict, with_verdict
from tests.plateviz.solving.waiting import Waiting


def test_solution_is_judged_once_for_all_pages(fit_result):
    waiting, result = Waiting(), replace(fit_result)
    judge = Judge(waiting)
    assert not judge.has_judged(result)
    assert not waiting.waiting
    judge.request(result)
    judge.request(result)
    assert not judge.has_judged(result)
    ((work, arguments, _),) = waiting.waiting
    work(*arguments)
    assert is_judged(result)
    assert judge.has_judged(result)
    judge.request(result)
    assert len(waiting.waiting) == 1


def test_solution_that_comes_with_its_verdict_is_not_judged_again(fit_result):
    waiting = Waiting()
    judge, judged = Judge(waiting), with_verdict(fit_result)
    judge.request(judged)
    assert judge.has_judged(judged)
    assert not waiting.waiting


def test_solution_of_the_solver_is_judged_there(fit_result, tmp_path):
    waiting = Waiting()
    judge, judged = Judge(waiting), with_verdict(fit_result)
    write_scratch_result(tmp_path / "result", fit_result, is_judged=False)
    result = read_scratch_result(tmp_path / "result", complete=lambda _: pytest.fail("waited"))
    judge.request(result)
    assert not judge.has_judged(result)
    write_verdict(tmp_path / "result", judged.summary["verdict"])
    assert judge.has_judged(result)
    assert orbit_verdict(result) == orbit_verdict(judged)
    assert not waiting.waiting


def test_solution_whose_solver_has_ended_is_judged_here(fit_result, tmp_path, monkeypatch):
    monkeypatch.setattr(scratch_result, "_LATE_SECONDS", 0.0)
    waiting = Waiting()
    write_scratch_result(tmp_path / "result", fit_result, is_judged=False)
    result = read_scratch_result(tmp_path / "result", complete=lambda _: False)
    Judge(waiting).request(result)
    ((work, arguments, _),) = waiting.waiting
    work(*arguments)
    assert is_judged(result)
    assert orbit_verdict(result) == orbit_verdict(with_verdict(fit_result))


def test_solution_that_cannot_be_judged_says_so_where_its_verdict_is_used(fit_result):
    broken = replace(fit_result, summary={})
    with ThreadPoolExecutor(1) as threads:
        judge = Judge(threads)
        judge.request(broken)
    assert judge.has_judged(broken)
    with pytest.raises(KeyError, match="order"):
        orbit_verdict(broken)
    # Its fault does not keep it in memory.
    reference = weakref.ref(broken)
    del broken
    gc.collect()
    assert reference() is None
    assert judge._begun == {}


def test_judge_forgets_a_solution_that_nobody_shows(fit_result):
    waiting = Waiting()
    judge, result = Judge(waiting), replace(fit_result)
    judge.request(result)
    waiting.waiting.clear()
    del result
    gc.collect()
    assert judge._begun == {}
