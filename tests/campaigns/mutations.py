"""Read mutated files: each has to be refused in words, or read with equal values.

    python tests/campaigns/mutations.py --trials 10000 --records mutations.jsonl [--first 0]
                                        [--workers 2]
    python tests/campaigns/mutations.py --one 4711

A trial is one mutated file. Its number is the seed, and decides the kind of file, the mutation and
so everything that happens. It is read by the functions that the program uses, in a process of its
own, which may take 30 s and 2 GB. A campaign that was stopped goes on with the same command. The
table at the end counts the trials of each kind by what became of them:

- refused: the reader raised `InputError`, whose message names the file
- equal: the values read are those of the file before
- edited: the values are other ones that satisfy the schema, and the format has no checksum that
  could tell, such as a digit of a CSV file

Anything else is a fault: changed values of a file with checksums, a refusal that is not in words,
another exception, a crash, 30 s, 2 GB. The exit code is 1 if there is any.
"""

import argparse
import atexit
import os
import shutil
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
# One thread, so that a process can fork, and times do not depend on the other cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from solver.errors import InputError
from tests.campaigns.limited_process import LimitedProcess
from tests.campaigns.mutators import mutate
from tests.campaigns.readers import (
    KINDS,
    Kind,
    RefusedError,
    Values,
    WrongError,
    check_words,
    fingerprint,
    inspect,
)
from tests.campaigns.seed_files import orbit_tables
from tests.campaigns.trials import Record, run_trials

LONGEST_SECONDS = 30.0
MOST_MB = 2000
# Room to exceed the limit, so that the excess is measured and does not look like a refusal.
_ADDRESS_SPACE = 8 * 1024**3
# Shares of the trials whose file is removed, and is inspected as well, by the same readers.
_VANISH = 0.04
_INSPECTED = 0.3
# From the best to the worst: the outcome of a trial is that of its worst reader.
ALLOWED = ("equal", "refused", "edited")
FAULTS = ("memory", "unclear", "wrong", "changed", "raised", "hung", "crashed")
OUTCOMES = (*ALLOWED, *FAULTS)


def main() -> int:
    arguments = parse_arguments()
    if arguments.one is not None:
        return show(arguments.one)
    numbers = range(arguments.first, arguments.first + arguments.trials)
    with executor(arguments.workers) as pool:
        records = run_trials(arguments.records, numbers, trial, pool, report)
    write(table(records))
    faults = [record for record in records if record["outcome"] in FAULTS]
    for record in faults[:20]:
        write(f"\n{record['number']} {record['kind']}, {record['file']}: {record['outcome']}")
        write(record["message"])
    return 1 if faults else 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=500, help="number of mutated files")
    parser.add_argument("--first", type=int, default=0, help="number of the first trial")
    parser.add_argument("--records", type=Path, default=Path("mutations.jsonl"))
    parser.add_argument("--workers", type=int, default=1, help="processes that run trials")
    parser.add_argument("--one", type=int, help="repeat this trial alone, and say what happened")
    return parser.parse_args()


def executor(workers: int) -> Any:
    if workers == 1:
        return nullcontext()
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"))


def write(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def report(number: int, record: Record) -> None:
    if record["outcome"] in FAULTS:
        write(f"trial {number}, {record['kind']}: {record['outcome']}")


def show(number: int) -> int:
    record = trial(number)
    for name, value in record.items():
        write(f"{name}: {value}")
    return 1 if record["outcome"] in FAULTS else 0


def trial(number: int) -> Record:
    """Mutate one file, read it in a child process, and return what happened."""
    kind = KINDS[number % len(KINDS)]
    seed, _ = seeds()[kind.name]
    random = Random(number)
    with TemporaryDirectory(prefix="mutation-") as work:
        folder = Path(work) / "files"
        shutil.copytree(seed, folder, copy_function=os.link)
        name, content = put_mutation(random, kind, folder)
        is_protected = content is None or kind.is_protected(name, content)
        request = {
            "kind": kind.name,
            "folder": str(folder),
            "file": name,
            "is_protected": is_protected,
            "is_inspected": random.random() < _INSPECTED,
        }
        answer = LIMITED.ask(request)
    readers = answer.value if answer.ended else {"all": ("hung", f"after {answer.seconds:.0f} s")}
    if readers is None:
        readers = {"all": ("crashed", "the process ended")}
    if answer.peak_mb > MOST_MB:
        readers["all"] = ("memory", f"{answer.peak_mb:.0f} MB")
    worst = max(readers.values(), key=lambda one: OUTCOMES.index(one[0]))
    return {
        "number": number,
        "kind": kind.name,
        "file": name if content is not None else f"{name} (removed)",
        "outcome": worst[0],
        "message": worst[1],
        "readers": {reader: one[0] for reader, one in readers.items()},
        "seconds": round(answer.seconds, 3),
        "peak_mb": round(answer.peak_mb),
    }


def put_mutation(random: Random, kind: Kind, folder: Path) -> tuple[str, bytes | None]:
    """Mutate or remove one file; return its name and new content, None if it was removed."""
    paths = sorted(path for path in folder.glob(kind.targets) if path.is_file())
    path = random.choice(paths)
    name = path.relative_to(folder).as_posix()
    before = path.read_bytes()
    path.unlink()
    if kind.can_vanish(name) and random.random() < _VANISH:
        return name, None
    content = mutate(random, before, kind.mutators)
    path.write_bytes(content)
    return name, content


def outcomes(request: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Return reader -> outcome and message."""
    kind = next(kind for kind in KINDS if kind.name == request["kind"])
    _, values = seeds()[kind.name]
    folder, is_protected = Path(request["folder"]), request["is_protected"]
    # A refusal of a folder's file may name another one, with which it does not agree.
    named = (str(folder),) if kind.is_folder else (request["file"],)
    found = {
        name: outcome(lambda read=read: read(folder), named, values[name], is_protected)
        for name, read in kind.readers.items()
    }
    if request["is_inspected"]:
        inspected = folder if kind.is_folder else folder / request["file"]
        found["inspect"] = outcome(lambda: inspect(inspected), named, {}, is_protected)
    return found


def outcome(
    read: Callable[[], Values], named: tuple[str, ...], before: dict[str, str], is_protected: bool
) -> tuple[str, str]:
    try:
        found = fingerprint(read())
    except InputError as error:
        return refusal(error, named)
    except RefusedError as error:
        return "refused", str(error)
    except WrongError as error:
        return "wrong", str(error)
    except Exception:  # noqa: BLE001 any exception is a fault to record
        return "raised", traceback.format_exc(limit=-6)
    changed = [key for key in {**before, **found} if before.get(key) != found.get(key)]
    if not changed:
        return "equal", ""
    return ("changed" if is_protected else "edited"), ", ".join(changed)


def refusal(error: InputError, named: tuple[str, ...]) -> tuple[str, str]:
    causes, cause = [], error
    while cause is not None:
        causes.append(cause)
        cause = cause.__cause__
    if any(isinstance(one, MemoryError) for one in causes):
        return "memory", str(error)
    try:
        check_words(str(error), *named)
    except WrongError as fault:
        return "unclear", str(fault)
    return "refused", str(error)


@cache
def seeds() -> dict[str, tuple[Path, dict[str, dict[str, str]]]]:
    """Return kind -> folder of its seed files, and the values that each of its readers reads.

    They are made and read in this process, so that its children need not import what is imported
    when it is first used.
    """
    root = Path(mkdtemp(prefix="seeds-"))
    atexit.register(shutil.rmtree, root, ignore_errors=True)
    with TemporaryDirectory() as unpacked:
        orbit = orbit_tables(Path(unpacked))
    found = {}
    for number, kind in enumerate(KINDS):
        folder = root / str(number)
        folder.mkdir()
        kind.make(folder, orbit)
        values = {one: fingerprint(read(folder)) for one, read in kind.readers.items()}
        found[kind.name] = folder, values
    return found


LIMITED = LimitedProcess(outcomes, LONGEST_SECONDS, _ADDRESS_SPACE)


def table(records: Iterable[Record]) -> str:
    """Return a Markdown table of outcomes by kind, with the slowest trial and the peak memory."""
    records = list(records)
    counts: dict[str, Counter[str]] = {kind.name: Counter() for kind in KINDS}
    for record in records:
        what = record["outcome"] if record["outcome"] in ALLOWED else "faults"
        counts[record["kind"]].update(["trials", what])
    counts["all"] = sum(counts.values(), Counter())
    columns = ("trials", "refused", "equal", "edited", "faults")
    lines = [f"| files | {' | '.join(columns)} |", f"|---|{'---:|' * len(columns)}"]
    for name, row in counts.items():
        lines.append(f"| {name} | {' | '.join(f'{row[column]:,}' for column in columns)} |")
    slowest = max(records, key=lambda record: record["seconds"])
    largest = max(records, key=lambda record: record["peak_mb"])
    return "\n".join(
        [
            *lines,
            "",
            f"Slowest trial: {slowest['number']} ({slowest['kind']}), {slowest['seconds']:.1f} s. "
            f"Peak memory: {largest['peak_mb']:,} MB in trial {largest['number']} "
            f"({largest['kind']}).",
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
