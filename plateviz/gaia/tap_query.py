"""One query to a TAP service, by astroquery: the whole answer, or one message why there is none.

astroquery is optional, takes long to import and asks Gaia's archive for its notices while it
is imported; so only a query imports it.
"""

import importlib
import io
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from http.client import HTTPException
from pathlib import Path
from typing import Any

from astropy.io import votable
from astropy.table import Table

from solver.errors import InputError
from solver.io.failures import reading

_PACKAGE = "astroquery"
# A service that has said nothing for so long will not; the queue is asked in short requests.
_TIMEOUT_S = 180.0
# What astroquery lets through: sockets and its HTTP errors, an address or an answer that it
# cannot take apart, a reply without the place of the job.
_FAILURES = (OSError, HTTPException, ValueError, AttributeError)
_LONGEST_REASON = 300


def service_name(url: str | None) -> str:
    """Return what messages and files call a service; None is the archive of Gaia."""
    return url or "the archive of Gaia"


def answer_to(query: str, url: str | None) -> Table:
    """Return the table with which a TAP service answers, columns and units as it names them.

    Parameters
    ----------
    query : ADQL
    url : address of the service; the archive of Gaia by default

    Raises
    ------
    InputError
        If astroquery is not installed, the service cannot be reached, refuses the query,
        or answers with anything but a whole table.
    """
    name = service_name(url)
    with tempfile.TemporaryDirectory(prefix="plateviz-") as folder:
        path = Path(folder) / "answer.vot"
        # It prints notices and errors, but what is printed here is one result or one message.
        with _patience(), redirect_stdout(io.StringIO()):
            try:
                refusal = _carry_out(query, url, path)
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
        if refusal:
            raise InputError(f"{name}: expected the query to be carried out, found {refusal}")
        with reading(name, "an answer that is a VOTable"):
            document = votable.parse(path, verify="ignore")
            table = document.get_first_table().to_table(use_names_over_ids=True)
    _check_whole(document, len(table), name)
    return table


def _carry_out(query: str, url: str | None, path: Path) -> str:
    """Save the answer to `path`; return in words why the service has none, else nothing."""
    # Not the synchronous way, which ends after a minute and which astroquery cuts to 2,000 rows.
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
    """Refuse an answer that the service has cut off; TAP says so behind the table."""
    for resource in document.resources:
        for info in resource.infos:
            if info.name == "QUERY_STATUS" and info.value.upper() != "OK":
                raise InputError(
                    f"{name}: expected a whole answer, found {info.value} after {rows} rows"
                    f"{': ' + _short(info.content) if info.content else ''}; "
                    f"a smaller field has fewer"
                )


def _short(reason: str) -> str:
    return " ".join(reason.split())[:_LONGEST_REASON]


@contextmanager
def _patience() -> Iterator[None]:
    """Let no connection that is made inside the block wait for ever."""
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(_TIMEOUT_S)
    try:
        yield
    finally:
        socket.setdefaulttimeout(before)
