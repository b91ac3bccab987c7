"""Trials of a campaign: each is recorded as one JSON line, so that a stopped campaign goes on.

Trials are numbered, and the number is the seed: a trial can be repeated alone, on any machine.
"""

import json
import os
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import Executor, as_completed
from pathlib import Path
from typing import Any

Record = Mapping[str, Any]


def run_trials(
    path: Path,
    numbers: Iterable[int],
    trial: Callable[[int], Record],
    executor: Executor | None = None,
    after: Callable[[int, Record], None] = lambda *_: None,
    version: str | None = None,
) -> list[Record]:
    """Run the trials that a file has no record of, and return the records of all, by number.

    Parameters
    ----------
    path : of the records; one JSON line per trial, appended as trials end
    trial : given its number, returns what is recorded
    executor : runs the trials; this process by default
    after : called with the number and the record of each trial that ran
    version : of what is tried; trials of another one are run again
    """
    wanted = list(numbers)
    records = read_records(path, version)
    missing = [number for number in wanted if number not in records]
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as lines:
        # A new line, in case that the last one was cut off.
        lines.write("\n" if missing and lines.tell() else "")

        def keep(number: int, record: Record) -> None:
            records[number] = record
            marked = {} if version is None else {"version": version}
            lines.write(json.dumps({"trial": number, **marked, **record}) + "\n")
            lines.flush()
            os.fsync(lines.fileno())
            after(number, record)

        if executor is None:
            for number in missing:
                keep(number, trial(number))
        else:
            running = {executor.submit(trial, number): number for number in missing}
            for future in as_completed(running):
                keep(running[future], future.result())
    return [records[number] for number in sorted(wanted)]


def read_records(path: Path, version: str | None = None) -> dict[int, Record]:
    """Return the records in a file by number, of one version; a line that was cut off is not one.

    Without a version, records are taken whatever theirs is.
    """
    records = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else []:
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            continue
        if version is not None and record.pop("version", None) != version:
            continue
        records[int(record.pop("trial"))] = record
    return records


def mark_records(path: Path, before: str, version: str, chosen: Collection[int]) -> None:
    """Mark the chosen records of a version in a file with another one, all or none of them."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            continue
        if record.get("version") == before and record["trial"] in chosen:
            record["version"] = version
        lines.append(json.dumps(record) + "\n")
    written = path.with_name(f"{path.name}.part")
    with written.open("w", encoding="utf-8") as file:
        file.writelines(lines)
        file.flush()
        os.fsync(file.fileno())
    written.replace(path)
