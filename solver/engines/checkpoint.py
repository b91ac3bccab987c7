"""The checkpoint file of an svi fit, from which a later fit resumes."""

import hashlib
import json
from pathlib import Path

import numpy as np

from solver.data.instrument import Instrument, write_instrument
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration
from solver.engines.run_engine import Resumption
from solver.engines.svi import SviState
from solver.errors import InputError
from solver.io.atomic import require_writable, write_atomically
from solver.io.failures import reading

_ARRAYS = ("theta", "sources", "scale", "losses")


def resume_from(
    path: Path, data: OrbitData, instrument: Instrument, settings: FitSettings
) -> Resumption:
    """Return the state to resume from, and save later states to the same file.

    Parameters
    ----------
    path : checkpoint of the same fit, or a path that does not exist yet
    data : orbit to fit; its files are recognised by their contents
    instrument : of the fit

    Raises
    ------
    InputError
        If the file is not a checkpoint of this fit, or cannot be written.
    """
    require_writable(path)
    fit = _fingerprint(data, instrument, settings)
    return Resumption(
        _read(path, fit) if path.exists() else None, lambda state: _write(path, fit, state)
    )


def _fingerprint(data: OrbitData, instrument: Instrument, settings: FitSettings) -> str:
    files = sorted(data.provenance.values())
    identity = [settings.identity(), files, data.orbit_id, write_instrument(instrument)]
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()


def _write(path: Path, fit: str, state: SviState) -> None:
    rows = [row._asdict() for row in state.trace]
    head = json.dumps({"fit": fit, "step": state.step, "cycle": state.cycle, "trace": rows})
    arrays = {name: getattr(state, name) for name in _ARRAYS}
    with write_atomically(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, head=np.array(head), **arrays)


def _read(path: Path, fit: str) -> SviState:
    failures = reading(str(path), "the checkpoint of an svi run")
    with failures, path.open("rb") as stream, np.load(stream) as file:
        head = json.loads(str(file["head"]))
        if head["fit"] != fit:
            raise InputError(
                f"{path}: expected the checkpoint of this fit, found that of other files, "
                "settings, or another instrument"
            )
        trace = [Iteration(**row) for row in head["trace"]]
        step, rate = head["cycle"]
        arrays = {name: file[name] for name in _ARRAYS}
        return SviState(step=head["step"], cycle=(step, rate), trace=trace, **arrays)
