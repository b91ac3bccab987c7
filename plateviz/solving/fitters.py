"""Fitters of the solver process: those of the last few orbits, and their preparation.

A request is the JSON object of `plateviz.solving.solver_process`.
"""

import json
import queue
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache

from plateviz.solving.origin import origin_from_dict
from solver.data.exclusions import Exclusions
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration
from solver.errors import CancelledError, FitError, InputError
from solver.fit import OrbitFitter

Request = dict


def fitter_of(request: Request) -> OrbitFitter:
    """Return the fitter of the orbit of a request; InputError if the orbit cannot be read."""
    return _fitter(json.dumps(request["origin"], sort_keys=True), request["orbit"])


@lru_cache(maxsize=4)
def _fitter(origin_json: str, orbit: int | None) -> OrbitFitter:
    origin = origin_from_dict(json.loads(origin_json))
    return OrbitFitter(origin.read(orbit), origin.read_instrument())


def base_settings(settings: FitSettings) -> FitSettings:
    """Return the settings of the fit that the what-ifs of `settings` start from.

    A fit without some measurements is no start for a what-if without others; one of all is.
    """
    return settings.with_(exclusions=Exclusions(), compare_orders=False)


def prepare(request: Request, requests: queue.Queue[Request | None]) -> Iterator[None]:
    """Fit an orbit and precompute its likely what-ifs; give way to requests for anything else."""

    def give_way(_: Iteration) -> None:
        with requests.mutex:
            waiting = list(requests.queue)
        if not all(_starts_from(request, later) for later in waiting):
            raise CancelledError("another request waits")

    # What is wrong with the orbit is said when something is asked of it.
    with suppress(CancelledError, InputError, FitError):
        fitter = fitter_of(request)
        settings = base_settings(FitSettings.from_dict(request["settings"]))
        if not _serves_what_ifs(fitter.fitted_settings, settings):
            fitter.fit(settings, give_way)
        yield from fitter.precompute(settings.order)


def _starts_from(prepared: Request, later: Request | None) -> bool:
    """Return whether a later request is a what-if that starts from the prepared fit."""
    return (
        later is not None
        and bool(later.get("what_if"))
        and all(later[key] == prepared[key] for key in ("origin", "orbit"))
    )


def _serves_what_ifs(fitted: FitSettings | None, settings: FitSettings) -> bool:
    """Return whether what-ifs of `settings` can start from the last fit of their orbit."""
    return (
        fitted is not None
        and not fitted.exclusions
        and fitted.order >= settings.order
        and fitted.what_if_holds(settings)
    )
