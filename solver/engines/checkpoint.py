"""A file in which an svi run is kept between blocks, so that a later run goes on from there."""

import hashlib
import json
from pathlib import Path

import numpy as np

from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration
from solver.engines.run_engine import Resumption
from solver.engines.svi import SviState
from solver.errors import InputError
from solver.io.atomic import require_writable, write_atomically
from solver.io.failures import reading

_ARRAYS = ("theta", "sources", "scale", "losses")


def resume_from(path: Path, data: OrbitData, settings: FitSettings) -> Resumption:
    """Return where a run is to go on, and have it kept in the same file.

    Parameters
    ----------
    path : a file that does not exist yet, or that an earlier run of the same fit has left
    data : the orbit that is fitted; its files are known again by their contents

    Raises
    ------
    InputError
        If the file is none of these, or cannot be written.
    """
    require_writable(path)
    fit = _fingerprint(data, settings)
    return Resumption(
        _read(path, fit) if path.exists() else None, lambda state: _write(path, fit, state)
    )


def _fingerprint(data: OrbitData, settings: FitSettings) -> str:
    said = [settings.identity(), sorted(data.provenance.values()), data.orbit_id]
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def _write(path: Path, fit: str, state: SviState) -> None:
    rows = [row._asdict() for row in state.trace]
    head = json.dumps({"fit": fit, "step": state.step, "cycle": state.cycle, "trace": rows})
    arrays = {name: getattr(state, name) for name in _ARRAYS}
    with write_atomically(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, head=np.array(head), **arrays)


def _read(path: Path, fit: str) -> SviState:
    said = reading(str(path), "the checkpoint of an svi run")
    with said, path.open("rb") as stream, np.load(stream) as file:
        head = json.loads(str(file["head"]))
        if head["fit"] != fit:
            raise InputError(
                f"{path}: expected the checkpoint of this very fit, found that of other files "
                "or settings"
            )
        trace = [Iteration(**row) for row in head["trace"]]
        step, rate = head["cycle"]
        arrays = {name: file[name] for name in _ARRAYS}
        return SviState(step=head["step"], cycle=(step, rate), trace=trace, **arrays)
