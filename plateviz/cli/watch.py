"""`plateviz watch`: fit the orbits of a survey as they arrive, with a line for each."""

import contextlib
import json
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plateviz.cache import keep_compilations
from plateviz.cli import options
from solver.errors import DistrustError, FitError

if TYPE_CHECKING:
    from plateviz.runs.watch import Event, Watch

# Unlike the run of `plateviz survey`, it stays open for orbits that arrive later.
_RUN = "watched"
# Event -> what is said of its orbit before the message.
_WORDS = {
    "failed": "has no solution",
    "waiting": "waits",
    "damaged": "cannot be read",
    "changed": "has changed",
}


@options.takes_settings("survey")
def watch(
    directory: Annotated[Path, typer.Argument(help="Survey directory.", metavar="DIR")],
    run: Annotated[
        str, typer.Option(help="Name of the run, which stays open for more orbits.")
    ] = _RUN,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Number of worker processes on this machine; one per core by default.", min=1
        ),
    ] = None,
    interval: Annotated[
        float, typer.Option(help="Seconds between two looks at the survey.", min=0.1, max=86_400.0)
    ] = 5.0,
    once: Annotated[
        bool, typer.Option("--once", help="Fit the orbits that are there now, and end.")
    ] = False,
    until: Annotated[
        int | None,
        typer.Option(
            help="End when N orbits are done, and complete the run if each of the survey's orbits "
            "has a solution.",
            metavar="N",
            min=1,
        ),
    ] = None,
    accept: Annotated[
        bool,
        typer.Option(
            "--accept", help="End with exit code 0 even if solutions should not be trusted."
        ),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a JSON object per line instead of text.")
    ] = False,
    **settings: Any,  # noqa: ANN401 the options of the settings
) -> None:
    """Fit the orbits of a survey as they arrive, and say what is not well, until Ctrl-C."""
    chosen = options.fit_settings(settings)
    keep_compilations()
    from plateviz.runs.watch import Ends, Watch

    watcher = Watch(directory, run, chosen, workers, _print_json if as_json else _print)
    # Ctrl-C is the normal way to end.
    with contextlib.suppress(KeyboardInterrupt):
        try:
            watcher.run(interval, Ends(once, until))
        finally:
            watcher.end()
    _judge(watcher, accept)


def _print(event: "Event") -> None:
    words = ""
    if event.kind == "fitted":
        words = f"orbit {event.orbit} fitted in {event.figures['seconds']:.1f} s. "
    elif event.orbit is not None:
        words = f"orbit {event.orbit} {_WORDS[event.kind]}: "
    elif event.kind == "waiting":
        words = "the survey waits: "
    typer.echo(f"{datetime.now().astimezone():%Y-%m-%d %H:%M:%S}  {words}{event.message}")


def _print_json(event: "Event") -> None:
    content = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "event": event.kind,
        "orbit": event.orbit,
        "message": event.message,
        **event.figures,
    }
    typer.echo(json.dumps(content))


def _judge(watcher: "Watch", accept: bool) -> None:
    """Raise the error that stands for orbits without a solution, or with one not to be trusted."""
    if watcher.unread:
        raise FitError(f"what could not be read at the last look: {'; '.join(watcher.unread)}")
    if watcher.failed:
        raise FitError(f"orbits without a solution: {_listed(watcher.failed)}")
    if watcher.distrusted and not accept:
        raise DistrustError(
            "orbits whose solutions should not be trusted as they are: "
            f"{_listed(watcher.distrusted)}; --accept ends with exit code 0"
        )


def _listed(orbits: Iterable[int]) -> str:
    return ", ".join(map(str, sorted(orbits)))
