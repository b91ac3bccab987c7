"""The page of the documents on the measured verdict, from the records of its campaign."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tests.campaigns import verdict_demands as demands
from tests.campaigns.trials import Record
from tests.campaigns.verdict_cases import CASES, FACTORS, DefectCase, trial_of
from tests.campaigns.verdict_chart import draw
from tests.campaigns.verdict_demands import named, rms_pull, seen

BEGIN, END = "<!-- verdicts:begin -->", "<!-- verdicts:end -->"
_NO_CAUSE, _GOOD = "no cause", "good"
# State of a trial whose defect the orbit has no room for.
IMPOSSIBLE = "impossible"
# Records of a defect: those at each factor, and those with the cause modelled.
_Records = Mapping[float | str, list[Record]]
_MODELLED = "modelled"


def write_page(folder: Path, records: Mapping[int, Record]) -> None:
    """Write the tables into the page of a folder, and its figure beside it."""
    page = folder / "verdicts.md"
    page.write_text(with_tables(page.read_text("utf-8"), records), "utf-8")
    (folder / "verdicts.svg").write_text(figure(records), "utf-8")


def with_tables(text: str, records: Mapping[int, Record]) -> str:
    """Return the text of the page with the tables of the records."""
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    return f"{before}{BEGIN}\n{tables(records)}\n{END}{after}"


def figure(records: Mapping[int, Record]) -> str:
    """Return the chart of what is seen and what is named, as SVG."""
    of_cases = _by_case(records)
    panels = {
        case.title.replace("`", ""): {
            "seen": [(f, _share(seen(of_case[f]))) for f in FACTORS if of_case[f]],
            "named rightly": [(f, _share(named(case, of_case[f]))) for f in FACTORS if of_case[f]],
        }
        for case, of_case in of_cases.items()
    }
    return draw(panels, FACTORS)


def tables(records: Mapping[int, Record]) -> str:
    """Return all tables of the page."""
    of_cases, clean = _by_case(records), _clean(records)
    states = Counter(one["state"] for one in clean)
    total = len(clean)
    lines = [
        f"The figures rest on {len(records):,} trials, {total} of them clean orbits.\n",
        "What is asked, at the amplitude whose pulls are nearest to 1.1:\n",
        *demands.of_clean(clean),
        "",
        *demands.of_defects(of_cases),
        "\nClean orbits:\n",
        "| orbits | good | with care | not to be trusted |",
        "|---:|---:|---:|---:|",
        f"| {total} | {_of(states[_GOOD], total)} | {_of(states['warn'], total)} "
        f"| {_of(states['bad'], total)} |\n",
        "Seen, and named rightly, of the orbits at each factor of the amplitude:\n",
        _row("defect", "amplitude", *(f"× {factor:g}" for factor in FACTORS)),
        "|---|---:|" + "---:|" * len(FACTORS),
        *(_seen_row(case, of_case) for case, of_case in of_cases.items()),
        "\nThe first cause that is named at each factor, and the rms pull there:\n",
        _row("defect", "factor", "pull", "first cause, orbits"),
        "|---|---:|---:|---|",
        *(
            _named_row(case, factor, of_case[factor])
            for case, of_case in of_cases.items()
            for factor in FACTORS
            if of_case[factor]
        ),
        "\nWith the cause modelled, at five times the amplitude:\n",
        _row(
            "defect",
            "fit with",
            "orbits",
            "trusted",
            "rms pull",
            "new parameters, deviation over sigma",
        ),
        "|---|---|---:|---:|---:|---:|",
        *(
            _modelled_row(case, of_case[_MODELLED])
            for case, of_case in of_cases.items()
            if of_case[_MODELLED]
        ),
        "",
        *demands.of_modelled({case: of_case[_MODELLED] for case, of_case in of_cases.items()}),
    ]
    return "\n".join(lines)


def _by_case(records: Mapping[int, Record]) -> Mapping[DefectCase, _Records]:
    found: dict[DefectCase, dict[float | str, list[Record]]] = {
        case: {key: [] for key in (*FACTORS, _MODELLED)} for case in CASES
    }
    for number, record in sorted(records.items()):
        trial = trial_of(number)
        if trial.case and record["state"] != IMPOSSIBLE:
            key = _MODELLED if trial.is_modelled else trial.factor
            found[trial.case][key].append(record)
    return found


def _clean(records: Mapping[int, Record]) -> list[Record]:
    return [record for number, record in records.items() if trial_of(number).case is None]


def _seen_row(case: DefectCase, of_case: _Records) -> str:
    cells = [
        f"{sum(seen(rows))}, {sum(named(case, rows))} of {len(rows)}" if rows else "-"
        for rows in (of_case[factor] for factor in FACTORS)
    ]
    return _row(case.title, case.words(1.0), *cells)


def _named_row(case: DefectCase, factor: float, records: Sequence[Record]) -> str:
    first = Counter(one["causes"][0] if one["causes"] else _NO_CAUSE for one in records)
    named = ", ".join(f"{name} {count}" for name, count in first.most_common())
    return _row(case.title, f"× {factor:g}", _pull(records), named)


def _modelled_row(case: DefectCase, records: Sequence[Record]) -> str:
    options = ", ".join(f"`{name}={value}`" for name, value in case.modelled.items())
    trusted = _of(len(records) - sum(seen(records)), len(records))
    squares = [(one["deviation"], one["parameters"]) for one in records if "deviation" in one]
    deviation = "-"
    if squares:
        values, counts = np.array(squares).T
        deviation = f"{np.sqrt(np.average(values**2, weights=counts)):.2f}"
    return _row(case.title, options, str(len(records)), trusted, _pull(records), deviation)


def _pull(records: Sequence[Record]) -> str:
    pull = rms_pull(records)
    return f"{pull:.3f}" if np.isfinite(pull) else "-"


def _of(count: int, total: int) -> str:
    return f"{count} of {total}"


def _share(flags: Sequence[bool]) -> float:
    return sum(flags) / max(len(flags), 1)


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"
