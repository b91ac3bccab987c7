"""One query to a TAP service with astroquery: the whole answer, or one error message.

astroquery is optional, slow to import, and requests notices from Gaia's archive on import;
therefore it is imported only for a query.
"""

import importlib
import io
import socket
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from http.client import HTTPException
from pathlib import Path
from typing import Any

from astropy.io import votable
from astropy.table import Table

from solver.data.plural import plural
from solver.errors import InputError
from solver.io.failures import reading
from solver.io.scratch import ScratchFolder, temporary_folder

_PACKAGE = "astroquery"
# Timeout of each connection; the state of a queued job is polled in short requests.
_TIMEOUT_S = 180.0
# Exceptions that astroquery does not catch: socket and HTTP errors, an address or an answer that
# it cannot parse, a reply without the location of the job.
_FAILURES = (OSError, HTTPException, ValueError, AttributeError)
_LONGEST_REASON = 300


def service_name(url: str | None) -> str:
    """Return the name of a service in messages and files; None is the archive of Gaia."""
    return url or "the archive of Gaia"


def answer_to(query: str, url: str | None) -> Table:
    """Return the answer of a TAP service to a query, with its column names and units.

    Parameters
    ----------
    query : ADQL
    url : address of the service; the archive of Gaia by default

    Raises
    ------
    InputError
        If astroquery is not installed, the service cannot be reached or rejects the query,
        or the answer is not a whole table.
    """
    name = service_name(url)
    with ScratchFolder(temporary_folder(), "plateviz-gaia") as scratch:
        path = scratch.path / "answer.vot"
        # astroquery prints notices and errors; plateviz prints one result or one message only.
        with _timeout(), redirect_stdout(io.StringIO()):
            try:
                failure = _run_job(query, url, path)
            except ImportError as error:
                raise InputError(
                    f"plateviz gaia: expected the package {_PACKAGE}, which the extra 'gaia' of "
                    f"plateviz installs, found: {error}"
                ) from error
            except _FAILURES as error:
                raise InputError(
                    f"{name}: expected an answer to the query, found {type(error).__name__}: "
                    f"{_short(str(error))}"
                ) from error
        if failure:
            raise InputError(f"{name}: expected the query to be completed, found {failure}")
        with reading(name, "an answer that is a VOTable"):
            document = votable.parse(path, verify="ignore")
            table = document.get_first_table().to_table(use_names_over_ids=True)
    _check_whole(document, len(table), name)
    return table


def _run_job(query: str, url: str | None, path: Path) -> str:
    """Save the answer to `path`; return the reason if there is none, otherwise an empty text."""
    # A synchronous query would end after a minute, and astroquery limits it to 2,000 rows.
    job = _service(url).launch_job_async(query, output_format="votable", background=True)
    _, phase = job.wait_for_job_end()
    if phase != "COMPLETED":
        return f"the job in phase {phase}: {_short(job.get_error())}"
    job.outputFileUser = str(path)
    job.save_results()
    return ""


def _service(url: str | None) -> Any:  # noqa: ANN401
    if url is None:
        return importlib.import_module(f"{_PACKAGE}.gaia").Gaia
    return importlib.import_module(f"{_PACKAGE}.utils.tap").TapPlus(url=url.rstrip("/"))


def _check_whole(document: votable.tree.VOTableFile, rows: int, name: str) -> None:
    """Raise InputError if the service truncated its answer, which TAP states after the table."""
    for resource in document.resources:
        for info in resource.infos:
            if info.name == "QUERY_STATUS" and info.value.upper() != "OK":
                raise InputError(
                    f"{name}: expected a whole answer, found {info.value} after {rows} "
                    f"{plural(rows, 'row')}"
                    f"{': ' + _short(info.content) if info.content else ''}; "
                    f"choose a smaller field"
                )


def _short(reason: str) -> str:
    return " ".join(reason.split())[:_LONGEST_REASON]


@contextmanager
def _timeout() -> Iterator[None]:
    """Set a timeout for all connections opened inside the block."""
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(_TIMEOUT_S)
    try:
        yield
    finally:
        socket.setdefaulttimeout(before)
