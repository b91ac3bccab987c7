"""What is asked of the verdict, and whether its trials meet it, as tables of the documents."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import beta

from tests.campaigns.trials import Record
from tests.campaigns.verdict_cases import FACTORS, DefectCase

# Share of clean orbits, at most: not to be trusted, and with care.
_MOST_BAD, _MOST_CARE = 0.005, 0.05
# Share of the orbits with a defect where pulls are 1.1, at least: seen; of these named rightly.
_LEAST_SEEN, _LEAST_NAMED, _WANTED_PULL = 0.95, 0.80, 1.1
# Pulls with the cause modelled.
_LOWEST_PULL, _HIGHEST_PULL = 0.97, 1.03
# Beyond this they say nothing of the amplitude.
_HIGHEST_SENSIBLE = 3.0


def rms_pull(records: Sequence[Record]) -> float:
    """Return the rms pull over the orbits that have one; NaN if none has."""
    pulls = [record["pull"] for record in records if record.get("converged")]
    return float(np.sqrt(np.mean(np.square(pulls)))) if pulls else float("nan")


def seen(records: Sequence[Record]) -> list[bool]:
    """Return which solutions are not called good."""
    return [record["state"] != "good" for record in records]


def named(case: DefectCase, records: Sequence[Record]) -> list[bool]:
    """Return which solutions have a right cause as their first one."""
    return [bool(record["causes"]) and record["causes"][0] in case.causes for record in records]


def factor_of_pulls(of_case: Mapping[float | str, Sequence[Record]]) -> float:
    """Return the factor of the amplitude at which the pulls are nearest to 1.1.

    It is 1 if no amplitude has pulls of that size, as swapped identifications.
    """
    pulls = {factor: rms_pull(of_case[factor]) for factor in FACTORS}
    known = {factor: pull for factor, pull in pulls.items() if pull < _HIGHEST_SENSIBLE}
    return min(known, key=lambda one: abs(known[one] - _WANTED_PULL), default=1.0)


def of_clean(records: Sequence[Record]) -> list[str]:
    """Return the table of the clean orbits."""
    total = len(records)
    lines = ["| clean orbits | asked | measured | met |", "|---|---:|---:|---|"]
    for state, words, most in (
        ("bad", "called not to be trusted", _MOST_BAD),
        ("warn", "called with care", _MOST_CARE),
    ):
        count = sum(record["state"] == state for record in records)
        lines.append(
            f"| {words} | at most {100 * most:g} % | {count} of {total}: below "
            f"{100 * _upper_limit(count, total):.1f} % with 95 % confidence "
            f"| {_met(count <= most * total)} |"
        )
    return lines


def of_defects(of_cases: Mapping[DefectCase, Mapping[float | str, Sequence[Record]]]) -> list[str]:
    """Return the table of the defects at the amplitude whose pulls are nearest to 1.1."""
    lines = [
        "| defect | amplitude | rms pull | seen (95 % asked) | of these named rightly "
        "(80 % asked) | met |",
        "|---|---:|---:|---:|---:|---|",
    ]
    for case, of_case in of_cases.items():
        factor = factor_of_pulls(of_case)
        records = of_case[factor]
        if not records:
            continue
        are_seen, are_named = seen(records), named(case, records)
        count, right = sum(are_seen), sum(a and b for a, b in zip(are_seen, are_named, strict=True))
        is_met = count >= _LEAST_SEEN * len(records) and right >= _LEAST_NAMED * count
        pull = rms_pull(records)
        lines.append(
            f"| {case.title} | × {factor:g} | {'-' if pull > _HIGHEST_SENSIBLE else f'{pull:.3f}'}"
            f" | {_share(count, len(records))} | {_share(right, count)} | {_met(is_met)} |"
        )
    return lines


def of_modelled(
    of_cases: Mapping[DefectCase, Sequence[Record]],
) -> list[str]:
    """Return a sentence on the pulls of fits that model the cause."""
    pulls = {case.title: rms_pull(records) for case, records in of_cases.items() if records}
    outside = {
        name: pull for name, pull in pulls.items() if not _LOWEST_PULL <= pull <= _HIGHEST_PULL
    }
    text = (
        f"Asked are pulls of {_LOWEST_PULL} to {_HIGHEST_PULL}: "
        f"{len(pulls) - len(outside)} of {len(pulls)} causes have them"
    )
    if outside:
        text += "; not " + ", ".join(f"{name} ({pull:.3f})" for name, pull in outside.items())
    return [f"{text}."]


def _upper_limit(count: int, total: int) -> float:
    """Return the share below which the true one is with 95 % confidence, of a binomial."""
    return float(beta.ppf(0.95, count + 1, total - count)) if total > count else 1.0


def _share(count: int, total: int) -> str:
    return f"{count} of {total}, {100 * count / max(total, 1):.0f} %"


def _met(is_met: bool) -> str:
    return "met" if is_met else "**missed**"
