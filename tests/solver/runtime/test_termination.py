"""SIGTERM ends a process as Ctrl-C does: scratch is removed, nothing is printed."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")

REPOSITORY = Path(__file__).resolve().parents[3]
HEAD = """
import asyncio, gc, sys, time
from pathlib import Path
from solver.io.scratch import ScratchFolder
from solver.runtime.termination import ending_on_sigterm

def say_and_sleep():
    print("ready", flush=True)
    time.sleep(60)

with ending_on_sigterm(), ScratchFolder(Path(sys.argv[1]), "some"):
"""
PLACES = {
    "in a function": "    say_and_sleep()",
    "in an event loop": """
    async def wait():
        print("ready", flush=True)
        while True:
            await asyncio.sleep(0.01)
    asyncio.run(wait())
""",
    "in the callback of a library that does not raise": """
    gc.callbacks.append(lambda *_: say_and_sleep())
    gc.collect()
    gc.callbacks.clear()
    time.sleep(60)
""",
    "while it ends": """
    try:
        say_and_sleep()
    finally:
        print("ready", flush=True)
        time.sleep(0.5)
""",
}


@pytest.mark.parametrize("place", PLACES)
def test_process_cleans_up_and_prints_nothing(tmp_path, place):
    process = subprocess.Popen(
        [sys.executable, "-c", HEAD + PLACES[place], str(tmp_path)],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for _ in range(2 if place == "while it ends" else 1):
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 143
    assert errors == ""
    assert list(tmp_path.iterdir()) == []
