"""Preparation: what the solver process does for the requests that are likely to come next.

It does so while no request waits, and gives way to all but those that it prepares.
"""

import queue
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from plateviz.runs.scratch_result import is_written
from plateviz.solving.fitters import Fitters, Request, base_of, base_settings
from plateviz.solving.put_off import PutOff
from solver.data.settings import FitSettings
from solver.errors import CancelledError, FitError, InputError
from solver.fit import OrbitFitter
from solver.runtime.interruption import interruptible

Requests = queue.Queue[Request | None]


class Preparation(NamedTuple):
    """Work in steps, each of which may be the last.

    Attributes
    ----------
    soon : what a person may ask for next
    later : what speeds up the requests after that
    is_urgent : whether to begin as soon as no request waits
    pause : seconds before it begins
    renew : returns the same again, but for what is done, if it has been interrupted
    """

    soon: Iterator[None] = iter(())
    later: Iterator[None] = iter(())
    is_urgent: bool = False
    pause: float = 0.0
    renew: Callable[[], "Preparation"] | None = None

    def paused(self, seconds: float) -> "Preparation":
        """Return the same, to begin later."""
        renewed = self if self.renew is None else self.renew()
        return renewed._replace(is_urgent=False, pause=seconds)


def get_ready(fitters: Fitters, request: Request) -> Preparation:
    """Make the orbit of a request ready for what-ifs, and compile what they need.

    Raises
    ------
    InputError, FitError
        If it cannot be read or fitted.
    """
    fitter, base = fitters.of(request), base_of(request)
    if base is not None:
        fitter.prepare_what_ifs(base.settings, solution=base.solution)
        fitter.partial_what_if(base.settings.with_(order=max(1, base.settings.order - 1)))
    return Preparation()


def prepare(fitters: Fitters, request: Request, requests: Requests, put_off: PutOff) -> Preparation:
    """Make the likely what-ifs of a solution, and precompute what later ones need.

    Parameters
    ----------
    request : with "may_fit", also fit what the what-ifs start from; with "only_fit", no more
    requests : those that wait
    put_off : takes what the likely what-ifs do without at first
    """
    order = FitSettings.from_dict(request["settings"]).order
    return Preparation(
        _soon(fitters, request, requests, put_off),
        iter(()) if request["only_fit"] else _precomputed(fitters, request, order),
        request["is_urgent"],
        renew=lambda: prepare(fitters, request, requests, put_off),
    )


def _soon(
    fitters: Fitters, request: Request, requests: Requests, put_off: PutOff
) -> Iterator[None]:
    # What is wrong with the orbit is said when something is asked of it.
    with suppress(CancelledError, InputError, FitError):
        fitter = fitters.of(request)
        if request["may_fit"]:
            _fit(fitter, request, requests)
            yield
        for likely in [] if request["only_fit"] else request["likely"]:
            with suppress(InputError, FitError):
                _make(fitter, likely, requests, put_off)
            yield
        put_off.finish_verdicts()


def _precomputed(fitters: Fitters, request: Request, order: int) -> Iterator[None]:
    with suppress(InputError):
        yield from fitters.of(request).precompute(order)


def _fit(fitter: OrbitFitter, request: Request, requests: Requests) -> None:
    """Fit what the what-ifs of a request start from, unless the last fit serves."""
    settings = base_settings(FitSettings.from_dict(request["settings"]))
    fitted = fitter.fitted_settings
    if fitted is not None and fitted.serves(settings):
        return
    base = base_of(request)
    solution = base.solution if base is not None and base.settings == settings else None
    with interruptible(_unless_all(requests, lambda later: _starts_from(request, later))):
        fitter.prepare_what_ifs(settings, solution=solution)


def _make(fitter: OrbitFitter, likely: dict[str, Any], requests: Requests, put_off: PutOff) -> None:
    """Make a what-if that is likely to be asked for, unless it needs a fit."""
    directory = Path(likely["directory"])
    if is_written(directory):
        return
    with interruptible(
        _unless_all(requests, lambda later: later.get("directory") == likely["directory"])
    ):
        found = fitter.partial_what_if(FitSettings.from_dict(likely["settings"]))
    if found is not None:
        # Nobody may ever ask for it: its eigenmodes are computed if somebody does.
        put_off.write(directory, found.result, is_partial=True)


def _unless_all(requests: Requests, holds: Callable[[Request], bool]) -> Callable[[], None]:
    """Return the check that interrupts work unless something holds for all requests that wait."""

    def check() -> None:
        with requests.mutex:
            waiting = list(requests.queue)
        if not all(later is not None and holds(later) for later in waiting):
            raise CancelledError("another request waits")

    return check


def _starts_from(prepared: Request, later: Request) -> bool:
    """Return whether a later request is a what-if that starts from the prepared fit."""
    is_what_if = later["do"] == "fit" and bool(later.get("what_if"))
    return is_what_if and all(later[key] == prepared[key] for key in ("origin", "orbit"))
