"""Kill plateviz at random moments: nothing that is finished changes, everything resumes.

    python tests/campaigns/kills.py --trials 200 --records kills.jsonl [--signal TERM] [--one N]

A trial starts a command, kills it or one of its processes at a random moment, checks what is left,
and runs the command again to its end. Faults are: a finished file that changed; a run or a survey
with a wrong manifest; a result that differs from that of an undisturbed command; a process that
outlives the command by ten seconds and the time that a process takes to start, before which it
cannot notice anything; a scratch folder that is left after the second command. With `--signal TERM`
the command must clean up itself, too, and print no traceback.

The number of a trial is its seed. A stopped campaign goes on where it was stopped.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
# As in the workers of a survey; copies of this process cannot choose it any more.
os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

from plateviz.cache import keep_compilations  # noqa: E402
from tests.campaigns.trials import Record, run_trials  # noqa: E402
from tests.campaigns.victims import (  # noqa: E402
    ORBITS,
    ORPHAN_SECONDS,
    SEED,
    STARS,
    VICTIMS,
    Files,
    Place,
    Victim,
    end,
    kill,
)

# Share of the time before the first output in which nothing is killed.
_TOO_EARLY = 0.7
# One trial in so many starts the command as a person does; the others run it in a copy of this
# process, which has imported what it needs.
_COMMANDS = 40
_PATIENCE_SECONDS = 240.0
_OF_CHILD = ("worker", "solver")


def main() -> None:
    arguments = parse_arguments()
    # All processes of the campaign share their compilations.
    keep_compilations()
    base = prepared(arguments.records.with_suffix(".base").resolve())
    trial = partial(tried, base, signal.Signals[f"SIG{arguments.signal}"])
    if arguments.one is not None:
        write(json.dumps(trial(arguments.one), indent=1))
        return
    records = run_trials(arguments.records, range(arguments.trials), trial, after=tell)
    write(table(records))
    sys.exit(1 if any(record["faults"] for record in records) else 0)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Kill plateviz at random moments.")
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--records", type=Path, default=Path("kills.jsonl"))
    parser.add_argument("--signal", choices=("KILL", "TERM"), default="KILL")
    parser.add_argument("--one", type=int, help="run one trial only, without a record")
    return parser.parse_args()


def prepared(base: Path) -> Path:
    """Return the folder with what trials start from, and what undisturbed commands take and give.

    Made once for a file of records.
    """
    path = base / "undisturbed.json"
    if path.is_file():
        return base
    for name, command in {
        "survey": ("simulate", "survey", "--orbits", ORBITS, "--stars", STARS, "--seed", SEED),
        "fitted": ("survey", "fitted"),
    }.items():
        place = Place(base / "making", base)
        if name == "fitted":
            subprocess.run(["cp", "-r", str(base / "survey"), str(place.folder / name)], check=True)
        if place.start(*command).wait() != 0:
            raise SystemExit(place.printed())
        (place.folder / name).rename(base / name)
    undisturbed = {}
    for name, victim in VICTIMS.items():
        # The first one makes the compilations.
        command, forked = (
            _undisturbed(victim, Place(base / "trial", base, is_forked))
            for is_forked in (victim.is_costly, True)
        )
        if command.pop("result") != forked["result"]:
            raise SystemExit(f"{name}: expected the same files from a copy of the process")
        undisturbed[name] = {"command": command, "copy": forked, "result": forked.pop("result")}
        write(f"{name}: {command}, {forked}")
    path.write_text(json.dumps(undisturbed), encoding="utf-8")
    return base


def _undisturbed(victim: Victim, place: Place) -> dict[str, object]:
    """Return when the command begins to write, when it is done, and what it writes."""
    victim.prepare(place)
    start = time.monotonic()
    process = victim.start(place)
    wait_until(lambda: victim.has_begun(place) or process.poll() is not None)
    begin = time.monotonic() - start
    wait_until(lambda: victim.is_done(process, place))
    seconds = time.monotonic() - start
    result = victim.result(place)
    if victim.stop(process) != 0 or not result:
        raise SystemExit(f"{victim.name}: expected to end well, found:\n{place.printed()}")
    return {"begin": round(begin, 2), "seconds": round(seconds, 2), "result": result}


def tried(base: Path, number: signal.Signals, trial: int) -> Record:
    """Run a trial and return its record."""
    random_numbers = random.Random(trial)
    victim = list(VICTIMS.values())[trial % len(VICTIMS)]
    measured = json.loads((base / "undisturbed.json").read_text("utf-8"))
    undisturbed = measured[victim.name]
    way = random_numbers.choice(victim.ways)
    is_copy = victim.is_costly or trial // len(VICTIMS) % _COMMANDS != 0
    started = "copy" if is_copy else "command"
    times = undisturbed[started]
    moment = random_numbers.uniform(_TOO_EARLY * times["begin"], times["seconds"])
    start_up = measured["survey, 2 workers"]["command"]["begin"]
    place = Place(base / "trial", base, is_copy, ORPHAN_SECONDS + start_up)
    victim.prepare(place)
    start = time.monotonic()
    process = victim.start(place)
    try:
        while time.monotonic() - start < moment and not victim.is_done(process, place):
            time.sleep(0.005)
        was_working = victim.has_begun(place) and not victim.is_done(process, place)
        was_hit = kill(process, place, way, number, random_numbers.random())
        faults, before = after_kill(victim, process, place, way if was_hit else "none", number)
        faults += after_resuming(victim, place, before, undisturbed["result"])
    finally:
        end(place)
    return {
        "kind": victim.name,
        "way": way if was_hit else "none: it had ended",
        "started": started,
        "moment": round(moment, 3),
        "in_work": was_working and was_hit,
        "finished": len(before),
        "faults": faults,
        "seconds": round(time.monotonic() - start, 1),
    }


def after_kill(
    victim: Victim, process: subprocess.Popen, place: Place, way: str, number: int
) -> tuple[list[str], Files]:
    """Return the faults of what a kill leaves, and the files that are finished."""
    faults = []
    before = victim.finished(place)
    if way in (*_OF_CHILD, "none"):
        victim.go_on(process, place)
        if not wait_until(lambda: victim.is_done(process, place)):
            return ["the command does not end after a child was killed"], before
        before = {**before, **victim.finished(place)}
        told = place.printed()
        code = victim.stop(process)
        if "Traceback" in told or (code == 0 and way != "none" and "plateviz: " in told):
            faults.append(f"exit code {code}, printed: {told[-600:]}")
    else:
        code = process.wait(_PATIENCE_SECONDS)
        before = {**before, **victim.finished(place)}
        faults += ended_by_sigterm(place, code) if number == signal.SIGTERM else []
    if not wait_until(lambda: not place.processes(), place.orphan_seconds):
        faults.append(f"outlive the command: {place.outliving()}")
        end(place)
    return faults + victim.faults(place), before


def ended_by_sigterm(place: Place, code: int) -> list[str]:
    """Return the faults of a command that was asked to end."""
    faults = []
    # Before the handler of the signal is there, nothing is written.
    if code not in (0, 128 + signal.SIGTERM, -signal.SIGTERM):
        faults.append(f"exit code {code} by SIGTERM")
    if place.leftovers():
        faults.append(f"left by SIGTERM: {place.leftovers()[:3]}")
    if "Traceback" in place.printed() or "Error" in place.printed():
        faults.append(f"printed by SIGTERM: {place.printed()[-600:]}")
    return faults


def after_resuming(victim: Victim, place: Place, before: Files, wanted: Files) -> list[str]:
    """Run the command again, undisturbed; return the faults of what it leaves."""
    if victim.is_complete(place):
        return [name for name in wanted if victim.result(place).get(name) != wanted[name]]
    process = victim.start(place)
    if not wait_until(lambda: victim.is_done(process, place)):
        return ["the second command does not end"]
    result, finished = victim.result(place), victim.finished(place)
    code = victim.stop(process)
    faults = [f"exit code {code}, printed: {place.printed()[-600:]}"] if code else []
    faults += [f"changed: {name}" for name in before if finished.get(name) != before[name]]
    faults += [
        f"differs from the undisturbed result: {name}"
        for name in sorted({*wanted, *result})
        if wanted.get(name) != result.get(name)
    ][:5]
    faults += [f"left: {name}" for name in place.leftovers()]
    if not wait_until(lambda: not place.processes(), place.orphan_seconds):
        faults.append(f"outlive the second command: {place.outliving()}")
    return faults + victim.faults(place)


def wait_until(condition: Callable[[], bool], seconds: float = _PATIENCE_SECONDS) -> bool:
    """Wait for a condition; return whether it holds in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def tell(trial: int, record: Record) -> None:
    verdict = "; ".join(record["faults"]) or "same bytes"
    write(
        f"{trial}: {record['kind']}, {record['way']} at {record['moment']} s, "
        f"{record['finished']} finished files, {record['seconds']} s: {verdict}"
    )


def table(records: list[Record]) -> str:
    """Return the outcome of each kind as a Markdown table."""
    lines = [
        "| killed | trials | in mid-work | resumed to the same bytes | faults |",
        "|---|---|---|---|---|",
    ]
    groups = {name: [r for r in records if r["kind"] == name] for name in VICTIMS}
    for name, rows in {**groups, "all": records}.items():
        working, faulty = (sum(bool(row[key]) for row in rows) for key in ("in_work", "faults"))
        lines.append(f"| {name} | {len(rows)} | {working} | {len(rows) - faulty} | {faulty} |")
    return "\n".join(lines)


def write(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
