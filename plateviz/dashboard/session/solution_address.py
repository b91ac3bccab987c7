"""Solutions in an address: by the run that has them, or by their settings in words.

    solution=order=3 prior=distortion_x=0.5um what-if
    solution=order=3 sources=many:KEY what-if
    solution=kept=NAME
    against=run=other orbit=7

Without `solution`, an address means that of its run, or a fit with the settings of the run or the
paper.
"""

import re
from collections.abc import Mapping

from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.selection.selected import MANY, keys_of, parsed
from plateviz.dashboard.session.solution import Request, Solution
from plateviz.runs.kept_solutions import KeptSolution, KeptSolutions
from plateviz.runs.run import Run
from solver.data.ids import ID
from solver.data.setting_words import parse_setting_words, setting_words
from solver.data.settings import FitSettings
from solver.data.subset import KINDS
from solver.errors import InputError
from solver.io.settings import parse_settings

WHAT_IF = "what-if"
TOO_LONG = "too-long"
"""Stands for a solution with more settings than an address has room for."""
# Browsers and proxies take addresses of eight thousand characters and more.
_MOST_CHARACTERS = 4000
# Of a solution in a saved view, which has no such limit.
_MOST_READ = 400_000
_TOO_MANY = "the settings were too many for the address"
_KEPT = "kept="
_OF_MANY = re.compile(rf"({'|'.join(KINDS)})={MANY}\w+")
_OF_RUN = re.compile(rf"run=(?P<run>[^ ]+)(?: orbit=(?P<orbit>{ID}))?")


def solution_query(
    shown: Solution | Request,
    other: Solution | None,
    run: str | None,
    large: LargeSelections | None,
) -> dict[str, str]:
    """Return a solution, and the one that it is compared with, as parts of an address.

    Parameters
    ----------
    run : name of the run in the address
    large : remembers what is left out, where that is too long for an address; None for a saved
        view, which has room for all
    """
    query = {"solution": _text(shown, shown.orbit, large)}
    kept, of_run = _where(shown)
    is_default = run is None and not (shown.is_what_if or kept)
    is_default = is_default and shown.settings == FitSettings()
    if is_default or (run is not None and of_run == run):
        query = {}
    if other is not None:
        query["against"] = _text(other, shown.orbit, large)
    return query


def find_solution(
    text: str | None,
    orbit: int | None,
    run: Run | None,
    runs: Mapping[str, Run],
    kept: KeptSolutions,
    large: LargeSelections,
) -> Solution | Request:
    """Return the solution that a part of an address names.

    Parameters
    ----------
    text : as `solution_query` writes it; None for the solution of the run
    orbit : orbit of the address
    run : run of the address
    runs : all runs of the survey, by name
    kept : solutions that are kept beside the runs
    large : what is left out of solutions, and too long for an address

    Raises
    ------
    InputError
        If a word is no setting, its value is invalid, there is no such run or orbit, or it
        cannot be read.
    """
    if text is None:
        found = solution_of_run(run, orbit)
        return found or Request(orbit, FitSettings() if run is None else run_settings(run))
    if text == TOO_LONG:
        raise InputError(_TOO_MANY)
    if len(text) > _MOST_READ:
        raise InputError(f"expected {_MOST_READ:,} characters or fewer, found {len(text):,}")
    if match := _OF_RUN.fullmatch(text):
        number = orbit if match["orbit"] is None else int(match["orbit"])
        found = solution_of_run(runs.get(match["run"]), number)
        if found is None:
            raise InputError(f"expected a run that has orbit {number}, found {match['run'][:40]!r}")
        return found
    if text.startswith(_KEPT):
        return read_kept(kept, kept.find(text.removeprefix(_KEPT)))
    words = text.split()
    settings = _settings([word for word in words if word != WHAT_IF], large)
    is_what_if = WHAT_IF in words
    if not is_what_if and run is not None and run_settings(run) == settings:
        return solution_of_run(run, orbit) or Request(orbit, settings)
    return Request(orbit, settings, is_what_if)


def _where(solution: Solution | Request) -> tuple[str, str]:
    """Return the names of the kept solution and of the run that it was read from."""
    return (solution.kept, solution.run) if isinstance(solution, Solution) else ("", "")


def settings_text(solution: Solution | Request) -> str:
    """Return the settings of a solution, and whether it is a what-if, in words."""
    return " ".join(
        [*setting_words(solution.settings), *([WHAT_IF] if solution.is_what_if else [])]
    )


def read_kept(kept: KeptSolutions, one: KeptSolution) -> Solution:
    """Return a kept solution; InputError if it is damaged, or of another instrument."""
    result = kept.read(one)
    return Solution(one.orbit, result.settings, result, is_what_if=one.is_what_if, kept=one.name)


def solution_of_run(run: Run | None, orbit: int | None) -> Solution | None:
    """Return the solution of an orbit in a run, None if it has none; InputError if damaged."""
    if run is None or orbit is None or not run.has_fitted(orbit):
        return None
    result = run.result(orbit)
    return Solution(orbit, result.settings, result, run=run.name)


def run_settings(run: Run) -> FitSettings:
    """Return the settings of a run; InputError if they cannot be read."""
    return parse_settings(run.header().get("settings"), f"run {run.name}")


def _settings(words: list[str], large: LargeSelections) -> FitSettings:
    """Return the settings that words say, of which some may be keys of what is left out."""
    many = [word for word in words if _OF_MANY.fullmatch(word)]
    settings = parse_setting_words(word for word in words if word not in many)
    if not many:
        return settings
    selected, problems = parsed(dict(word.split("=", 1) for word in many), large.find)
    if problems:
        raise InputError(_TOO_MANY)
    return settings.with_(exclusions=settings.exclusions | selected)


def _text(solution: Solution | Request, orbit: int | None, large: LargeSelections | None) -> str:
    """Return a solution as text, in an address of an orbit.

    Parameters
    ----------
    large : as of `solution_query`
    """
    kept, run = _where(solution)
    if kept:
        return f"{_KEPT}{kept}"
    if run:
        of_orbit = "" if solution.orbit == orbit else f" orbit={solution.orbit}"
        return f"run={run}{of_orbit}"
    text = settings_text(solution)
    if large is None or len(text) <= _MOST_CHARACTERS:
        return text if len(text) <= _MOST_READ else TOO_LONG
    selected = solution.settings.exclusions
    large.remember(selected)
    many = keys_of(selected)
    few = selected.of_kinds([kind for kind in selected.kinds if kind not in many])
    shorter = solution._replace(settings=solution.settings.with_(exclusions=few))
    keys = (f"{kind}={MANY}{key}" for kind, key in many.items())
    text = " ".join([*keys, settings_text(shorter)])
    return text if len(text) <= _MOST_CHARACTERS else TOO_LONG
