"""Mutated files of every kind are refused in words or read with equal values.

These are the first trials of the campaign `tests/campaigns/mutations.py`, in a process of its own:
it forks, which a process with the threads of JAX must not do.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from solver.errors import InputError
from tests.campaigns import readers
from tests.campaigns.limited_process import LimitedProcess
from tests.campaigns.mutations import FAULTS, outcome, table
from tests.campaigns.trials import read_records

CAMPAIGN = Path(__file__).resolve().parent / "campaigns" / "mutations.py"


@pytest.mark.slow
@pytest.mark.parametrize("trials", [30, pytest.param(500, marks=pytest.mark.full)])
def test_first_trials_have_no_fault(trials, tmp_path):
    records = tmp_path / "mutations.jsonl"
    command = [sys.executable, str(CAMPAIGN), "--trials", str(trials), "--records", str(records)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    found = read_records(records)
    assert sorted(found) == list(range(trials))
    kinds = {record["kind"] for record in found.values()}
    assert kinds == {kind.name for kind in readers.KINDS}
    assert re.search(rf"\| all \| {trials} \| \d+ \| \d+ \| \d+ \| 0 \|", run.stdout)


def found_of(answer, is_protected=True):
    def read():
        if isinstance(answer, Exception):
            raise answer
        return {"value": answer}

    return outcome(read, ("a.csv",), {"value": "1"}, is_protected)[0]


def with_cause(error, cause):
    error.__cause__ = cause
    return error


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (1, "equal"),
        (2, "changed"),
        (InputError("a.csv: expected a table, found none"), "refused"),
        (InputError(""), "unclear"),
        (InputError("expected a table, found none"), "unclear"),
        (InputError("a.csv: expected a table, found ArrowInvalid: CSV"), "unclear"),
        (InputError("a.csv: found <class 'int'>"), "unclear"),
        (with_cause(InputError("a.csv: too large"), MemoryError()), "memory"),
        (ValueError("a.csv: no InputError"), "raised"),
        (readers.WrongError("a column is missing"), "wrong"),
    ],
    ids=repr,
)
def test_outcome(answer, expected):
    assert found_of(answer) == expected
    assert (expected in FAULTS) == (expected not in ("equal", "refused"))


def test_other_values_are_allowed_where_no_checksum_protects_them():
    assert found_of(2, is_protected=False) == "edited"


def test_table_counts_kinds_and_faults():
    record = {"kind": "CSV", "number": 4, "seconds": 1.25, "peak_mb": 210}
    text = table([{**record, "outcome": "refused"}, {**record, "outcome": "hung"}])
    assert "| CSV | 2 | 1 | 0 | 0 | 1 |" in text
    assert "Slowest trial: 4 (CSV), 1.2 s. Peak memory: 210 MB" in text


LIMITS = """
import sys, time
sys.path.insert(0, sys.argv[1])
from tests.campaigns.limited_process import LimitedProcess

def work(request):
    if request == "sleep":
        time.sleep(60)
    if request == "end":
        import os
        os._exit(3)
    return len(bytearray(request * 2**20)) if isinstance(request, int) else request

process = LimitedProcess(work, 1.0, 8 * 2**30)
print([process.ask(request)[:2] for request in ("a", "sleep", "b", "end", "c")])
# A busy machine takes long to give so much memory.
process = LimitedProcess(work, 30.0, 8 * 2**30)
large, small = process.ask(300), process.ask(1)
print(large.value == 300 * 2**20, large.peak_mb > 300, small.peak_mb < large.peak_mb - 200)
"""


def test_process_that_hangs_or_ends_is_started_again():
    command = [sys.executable, "-c", LIMITS, str(CAMPAIGN.parents[2])]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    first, second = run.stdout.splitlines()
    assert first == "[('a', True), (None, False), ('b', True), (None, True), ('c', True)]"
    assert second == "True True True"


def test_process_is_not_forked_before_it_is_asked():
    assert LimitedProcess(len, 1.0, 2**30)._child is None
