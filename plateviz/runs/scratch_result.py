"""Results on their way from the solver process to its server: whole or absent, read in place.

No user interface and no JAX. A directory has an uncompressed Arrow file for each table, and
`result.json`. It is written under another name and then renamed. It lasts as long as the server,
and no other program reads it: nothing is flushed to the disk, and nothing has a checksum.
`plateviz.runs.fitted_orbit` writes what is kept.

The verdict may follow later, and the eigenmodes if somebody asks for them. Who uses them waits.
"""

import json
import math
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import pandas as pd

from plateviz.runs.scratch_table import read_scratch_table, write_scratch_table
from solver.data.eigenmode_schema import EIGENMODE_TABLES
from solver.data.instrument import instrument_from, instrument_text
from solver.data.result import FitResult
from solver.data.schema import RESULT_TABLES
from solver.errors import InputError
from solver.io.disk import writing
from solver.io.failures import reading
from solver.io.settings import parse_settings

_HEAD, _JUDGEMENT = "result.json", "verdict.json"
VERDICT, EIGENMODES = "verdict", "eigenmodes"
"""Parts of a result that may be written later."""
_LATER = tuple(table.name for table in EIGENMODE_TABLES)
# A page may ask again and again for longer than a thread waits.
_PATIENCE_SECONDS, _PATIENCE_OF_PAGE, _LOOK_SECONDS = 10.0, 60.0, 0.005
# A solver with other requests puts a verdict off, and in the end gives it up. So a page that is
# still there after so long asks for it.
_LATE_SECONDS = 5.0

Complete = Callable[[str], bool]


def write_scratch_result(
    directory: Path, result: FitResult, *, is_partial: bool = False, is_judged: bool = True
) -> None:
    """Write a result; an existing directory is not changed.

    Parameters
    ----------
    is_partial : whether `write_eigenmodes` follows, at the latest when somebody asks for them
    is_judged : False if `write_verdict` follows

    Raises
    ------
    DiskError
        If the disk is full or takes no file for another reason.
    InputError
        If writing fails otherwise.
    """
    with writing(directory, "to write the result of a fit"):
        staging = Path(mkdtemp(prefix=f".{directory.name}-", dir=directory.parent))
        try:
            for table in RESULT_TABLES:
                frame = getattr(result, table.name)
                if frame is not None:
                    write_scratch_table(staging / f"{table.name}.arrow", frame)
            head = {
                "settings": result.settings.to_dict(),
                "summary": dict(result.summary),
                "provenance": dict(result.provenance),
                "instrument": instrument_text(result.instrument),
                "is_partial": is_partial,
                "is_judged": is_judged,
            }
            (staging / _HEAD).write_text(json.dumps(head), encoding="utf-8")
            if not directory.exists():
                staging.rename(directory)
        finally:
            shutil.rmtree(staging, ignore_errors=True)


def write_eigenmodes(directory: Path, tables: Mapping[str, pd.DataFrame]) -> None:
    """Add the eigenmodes to a result that was written without; errors as above."""
    with writing(directory, "to write the eigenmodes of a fit"):
        for name in _LATER:
            write_scratch_table(directory / f"{name}.part", tables[name])
            (directory / f"{name}.part").rename(directory / f"{name}.arrow")


def write_verdict(directory: Path, verdict: Mapping[str, Any]) -> None:
    """Add the verdict to a result that was written without; errors as above.

    Parameters
    ----------
    verdict : as `plateviz.verdict.verdict.with_verdict` adds it to a summary
    """
    with writing(directory, "to write the verdict on a fit"):
        part = directory / f"{VERDICT}.part"
        part.write_text(json.dumps(verdict), encoding="utf-8")
        part.rename(directory / _JUDGEMENT)


def is_judged_later(result: FitResult) -> bool:
    """Return whether the verdict on a result is to follow, is not there yet, nor given up."""
    return isinstance(result.summary, _JudgedLater) and result.summary.is_to_come


def request_late_verdict(result: FitResult) -> None:
    """Have the verdict on a result made if it is late, unless it has been requested."""
    if isinstance(result.summary, _JudgedLater):
        result.summary.request_if_late()


def are_eigenmodes_written(directory: Path) -> bool:
    """Return whether the eigenmodes of a result are all there."""
    return _last_of_eigenmodes(directory).is_file()


def is_verdict_written(directory: Path) -> bool:
    """Return whether the verdict on a result is there that was to follow."""
    return (directory / _JUDGEMENT).is_file()


def are_eigenmodes_to_come(result: FitResult) -> bool:
    """Return whether the eigenmodes of a result are not there yet, and are not given up."""
    awaited = vars(result)[_LATER[0]]
    return isinstance(awaited, _Awaited) and awaited.is_to_come


def request_eigenmodes(result: FitResult) -> None:
    """Have the eigenmodes of a result made, unless they are there or have been requested."""
    awaited = vars(result)[_LATER[0]]
    if isinstance(awaited, _Awaited):
        awaited.request()


def is_written(directory: Path) -> bool:
    """Return whether a directory has a result, which is whole from the first moment on."""
    return (directory / _HEAD).is_file()


def read_scratch_result(directory: Path, complete: Complete = lambda _: True) -> "ScratchResult":
    """Read a result; its tables stay in their files, and are loaded where they are used.

    Parameters
    ----------
    complete : called with a part that is used and has not been written yet; whether it will be

    Raises
    ------
    InputError
        If there is none, or it cannot be read.
    """
    with reading(str(directory), "the result of a fit"):
        head = json.loads((directory / _HEAD).read_text(encoding="utf-8"))
        eigenmodes = _Awaited(_last_of_eigenmodes(directory), partial(complete, EIGENMODES))
        tables: dict[str, pd.DataFrame | _Awaited | None] = {
            table.name: eigenmodes
            if head["is_partial"] and table.name in _LATER
            else read_scratch_table(directory / f"{table.name}.arrow")
            for table in RESULT_TABLES
        }
        summary = head["summary"]
        if not head["is_judged"]:
            verdict = _Awaited(directory / _JUDGEMENT, partial(complete, VERDICT))
            summary = _JudgedLater(summary, verdict)
        return ScratchResult(
            **tables,  # type: ignore[arg-type]
            summary=summary,
            settings=parse_settings(head["settings"], str(directory / _HEAD)),
            provenance=head["provenance"],
            instrument=instrument_from(head["instrument"], directory / _HEAD),
        )


class _Awaited:
    """A file that may not be there yet."""

    def __init__(self, path: Path, complete: Callable[[], bool]) -> None:
        self.path, self._complete = path, complete
        # When a page gives up, as `time.monotonic`; None until it is requested.
        self._end: float | None = None

    @property
    def is_there(self) -> bool:
        return self.path.is_file()

    @property
    def is_to_come(self) -> bool:
        """Whether it is not there yet, and is not given up."""
        return not self.is_there and (self._end is None or time.monotonic() < self._end)

    def request(self) -> None:
        """Have it made, unless it is there or has been requested."""
        if self._end is None and not self.is_there:
            self._end = time.monotonic() + _PATIENCE_OF_PAGE if self._complete() else -math.inf

    def wait(self, end: float) -> bool:
        """Request it, and wait for it until some `time.monotonic`; return whether it is there."""
        self.request()
        while self.is_to_come and time.monotonic() < end:
            time.sleep(_LOOK_SECONDS)
        return self.is_there

    def table(self, name: str) -> pd.DataFrame | None:
        """Return a table beside it once it is there."""
        if not self.wait(time.monotonic() + _PATIENCE_SECONDS):
            # Who uses it next requests it anew.
            self._end = None
            raise InputError(
                f"{self.path}: expected the eigenmodes of the solution, found that the solver "
                "ended or had no time to write them; fit again"
            )
        return read_scratch_table(self.path.with_name(f"{name}.arrow"))


def _last_of_eigenmodes(directory: Path) -> Path:
    """Return the file that is there once all eigenmodes are."""
    return directory / f"{_LATER[-1]}.arrow"


class _JudgedLater(Mapping[str, Any]):
    """The summary of a result whose verdict follows; if it does not in time, there is none."""

    def __init__(self, known: dict[str, Any], verdict: _Awaited) -> None:
        self._known, self._verdict = known, verdict
        self._late, self._is_missing = time.monotonic() + _LATE_SECONDS, False

    @property
    def is_to_come(self) -> bool:
        if VERDICT in self._known or self._verdict.is_there or self._is_missing:
            return False
        return time.monotonic() < self._late or self._verdict.is_to_come

    def request_if_late(self) -> None:
        if self.is_to_come and time.monotonic() >= self._late:
            self._verdict.request()

    def __getitem__(self, key: str) -> Any:  # noqa: ANN401 whatever a summary holds
        return (self._whole() if key == VERDICT else self._known)[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._whole())

    def __len__(self) -> int:
        return len(self._whole())

    def _whole(self) -> dict[str, Any]:
        if self.is_to_come:
            self._is_missing = not self._verdict.wait(time.monotonic() + _PATIENCE_SECONDS)
        if VERDICT not in self._known and self._verdict.is_there:
            text = self._verdict.path.read_text(encoding="utf-8")
            self._known[VERDICT] = json.loads(text)
        return self._known


class _Later:
    """A field that reads its table when it is first used."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, result: FitResult | None, owner: type) -> pd.DataFrame | None:
        if result is None:
            return None
        value = result.__dict__[self._name]
        if isinstance(value, _Awaited):
            value = result.__dict__[self._name] = value.table(self._name)
        return value

    def __set__(self, result: FitResult, value: object) -> None:
        result.__dict__[self._name] = value


class ScratchResult(FitResult):
    """A result of a scratch directory: a `FitResult` whose eigenmodes may be written later."""

    eigenmodes = _Later()  # type: ignore[assignment]
    mode_parameters = _Later()  # type: ignore[assignment]
    mode_shifts = _Later()  # type: ignore[assignment]
