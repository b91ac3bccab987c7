"""The campaign of the verdict: its schedule, its version, and the page that it writes."""

import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.campaigns.carried import carry_over
from tests.campaigns.trials import read_records, run_trials
from tests.campaigns.verdict_cases import CASES, CLEAN, FACTORS, ORBITS, numbers, trial_of
from tests.campaigns.verdict_page import BEGIN, END, figure, tables, with_tables
from tests.campaigns.verdict_version import code_of, verdict_files, verdict_version

DOCUMENTS = Path(__file__).resolve().parent.parent / "assets" / "docs"


def test_every_trial_is_scheduled_once():
    trials = [trial_of(number) for number in numbers()]
    assert len(set(numbers())) == len(trials)
    cells = Counter(
        (one.case, one.factor, one.is_modelled) for one in trials if one.case is not None
    )
    for (case, _, is_modelled), count in cells.items():
        assert count == (case.modelled_orbits if is_modelled else ORBITS)
    modelled = sum(bool(case.modelled) for case in CASES)
    assert len(cells) == len(CASES) * len(FACTORS) + modelled
    assert sum(one.case is None for one in trials) == CLEAN


def test_first_trials_hold_all_defects_alike():
    first = [trial_of(number) for number in numbers()[:200]]
    counts = Counter(one.case for one in first if one.case and not one.is_modelled)
    assert set(counts) == set(CASES)
    assert max(counts.values()) - min(counts.values()) <= 4


def test_version_is_that_of_the_code_and_not_of_its_words():
    source = 'def f():\n    """Say so."""\n    return 1  # one\n'
    assert code_of(source) == code_of(source.replace("Say so.", "Say it.").replace("# one", ""))
    assert code_of(source) != code_of(source.replace("return 1", "return 2"))
    assert verdict_version() == verdict_version()


def test_version_changes_with_the_name_of_a_cause():
    code = "".join(code_of(path.read_text("utf-8")) for path in verdict_files())
    for case in CASES:
        for name in case.causes:
            assert f"'{name.removesuffix('-x').removesuffix('-y')}" in code, name


def test_trials_of_another_version_are_run_again(tmp_path):
    path, ran = tmp_path / "trials.jsonl", []

    def trial(number):
        ran.append(number)
        return {"state": "good"}

    run_trials(path, range(2), trial, version="a")
    run_trials(path, range(2), trial, version="a")
    assert ran == [0, 1]
    run_trials(path, range(2), trial, version="b")
    assert ran == [0, 1, 0, 1]
    assert set(read_records(path, "a")) == set(read_records(path, "b")) == {0, 1}
    assert read_records(path, "c") == {}


def recorded_trials(path, version="a"):
    """Record trials of all cases, whose state depends on the number, and return how to repeat."""

    def trial(number):
        state = "bad" if number % 2 else "good"
        return {"state": state, "causes": [], "converged": True, "sigma": round(number / 9.0, 1)}

    run_trials(
        path, [1000 * slot + 1 for slot in range(1 + 6 * len(CASES))], trial, version=version
    )
    return trial


def test_records_are_carried_over_to_a_version_that_judges_alike(tmp_path):
    path = tmp_path / "trials.jsonl"
    trial = recorded_trials(path)
    repeated = []

    def alike(number):
        repeated.append(number)
        return trial(number) | {"sigma": trial(number)["sigma"] + 0.1, "seconds": 3.0}

    before = read_records(path, "a")
    assert carry_over(path, alike, "a", "b", 160) == (len(before), [])
    assert len(repeated) == len(set(repeated))
    cases = {(trial_of(number).case, trial_of(number).is_modelled) for number in repeated}
    assert len(cases) == 2 * len(CASES) + 1
    assert {trial_of(number).factor for number in repeated} == {0.0, *FACTORS}
    assert read_records(path, "b") == before
    assert read_records(path, "a") == {}


@pytest.mark.parametrize(
    "change", [{"state": "warn"}, {"causes": ["noise"]}, {"converged": False}, {"sigma": -1.0}]
)
def test_records_of_a_case_stay_if_a_verdict_differs(tmp_path, change):
    path = tmp_path / "trials.jsonl"
    trial, odd = recorded_trials(path), 4001
    before = read_records(path, "a")
    other = lambda number: trial(number) | (change if number == odd else {})  # noqa: E731
    carried, (line,) = carry_over(path, other, "a", "b", 10_000)
    assert line.startswith(f"{trial_of(odd).case.title}, {odd}: recorded state")
    # Those of the defect at any amplitude, and not those with its cause modelled.
    assert set(read_records(path, "a")) == {1001, 2001, 3001, 4001, 5001}
    assert carried == len(before) - 5
    kept = {number: record for number, record in before.items() if not 1000 < number < 6000}
    assert read_records(path, "b") == kept
    with pytest.raises(ValueError, match="expected records of version c"):
        carry_over(path, other, "c", "b", 60)


@pytest.fixture
def records():
    """Orbits of the first defect at one amplitude, the second of which is named wrongly."""
    good = {"state": "good", "causes": [], "pull": 1.0, "converged": True}
    right = {"state": "bad", "causes": list(CASES[0].causes), "pull": 1.1, "converged": True}
    wrong = {"state": "warn", "causes": ["noise"], "pull": 1.1, "converged": True}
    at_one = 1000 * (1 + FACTORS.index(1.0))
    modelled = 1000 * (1 + len(FACTORS))
    with_truth = good | {"deviation": 2.0, "parameters": 6}
    return {0: good, 1: wrong, at_one: right, at_one + 1: wrong, modelled: with_truth}


def test_page_has_the_shares_of_the_records(records):
    text = tables(records)
    assert "rest on 5 trials, 2 of them clean orbits" in text
    assert "| 2 | 1 of 2 | 1 of 2 | 0 of 2 |" in text
    assert f"| `{CASES[0].name}` | 0.085 um | - | - | 2, 1 of 2 | - | - |" in text
    assert f"| `{CASES[0].name}` | × 1 | 1.100 | {CASES[0].causes[0]} 1, noise 1 |" in text
    assert "| called not to be trusted | at most 0.5 % | 0 of 2: below 77.6 % with" in text
    assert "| called with care | at most 5 % | 1 of 2: below 97.5 % with 95 %" in text
    assert (
        f"| `{CASES[0].name}` | × 1 | 1.100 | 2 of 2, 100 % | 1 of 2, 50 % | **missed** |" in text
    )
    assert "pulls of 0.97 to 1.03: 1 of 1 causes have them." in text
    assert f"| `{CASES[0].name}` | `drift=2` | 1 | 1 of 1 | 1.000 | 2.00 |" in text
    page = f"before {BEGIN} old {END} after"
    assert with_tables(page, records) == f"before {BEGIN}\n{text}\n{END} after"


def test_trial_without_room_for_its_defect_counts_for_nothing(records):
    at_one = 1000 * (1 + FACTORS.index(1.0))
    records[at_one + 2] = {"state": "impossible", "causes": [], "failed": "no room"}
    assert f"| `{CASES[0].name}` | 0.085 um | - | - | 2, 1 of 2 | - | - |" in tables(records)


def test_demands_look_at_the_amplitude_whose_pulls_are_nearest(records):
    low = 1000 * (1 + FACTORS.index(0.5))
    at_one = 1000 * (1 + FACTORS.index(1.0))
    records[low] = records[at_one] | {"pull": 1.12}
    records[at_one] = records[at_one] | {"pull": 1.6}
    assert f"| `{CASES[0].name}` | × 0.5 | 1.120 | 1 of 1, 100 % | 1 of 1, 100 % | met |" in tables(
        records
    )


def test_figure_has_a_point_for_each_share(records):
    root = ET.fromstring(figure(records))
    circles = list(root.iter("{http://www.w3.org/2000/svg}circle"))
    # Two of the legend, and of the one amplitude the share seen and the share named.
    assert len(circles) == 4
    seen, named = (float(circle.get("cy")) for circle in circles[2:])
    assert named > seen


# The digest is of the syntax tree, which each Python writes in its own way.
@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="the campaign ran on Python 3.11")
def test_records_are_of_the_present_verdict():
    """Otherwise run `verdicts.py`, or with `--carry-over` if the verdicts are to be the same."""
    assert len(read_records(DOCUMENTS / "verdicts.jsonl", verdict_version())) == len(numbers())


def test_page_shows_the_records_of_its_file():
    records = read_records(DOCUMENTS / "verdicts.jsonl")
    assert records
    text = (DOCUMENTS / "verdicts.md").read_text("utf-8")
    assert with_tables(text, records) == text
    assert figure(records) == (DOCUMENTS / "verdicts.svg").read_text("utf-8")
