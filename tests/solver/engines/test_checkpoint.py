from dataclasses import replace

import numpy as np
import pytest

from solver.data.engine_settings import SviSettings
from solver.data.settings import FitSettings
from solver.engines.checkpoint import resume_from
from solver.engines.gauss_newton import Iteration
from solver.engines.svi import SviState
from solver.errors import CancelledError, InputError
from solver.fit import OrbitFitter

SETTINGS = FitSettings(engine="svi", svi=SviSettings(steps=100, max_steps=150))


@pytest.fixture
def state():
    rng = np.random.default_rng(0)
    trace = [Iteration(50, 3.0, 2.0, 1.0, "focal length [3]", 0.0, 0.5)]
    arrays = rng.standard_normal(5), rng.standard_normal((4, 2)), rng.standard_normal((2, 4))
    return SviState(50, (0, 1e4), *arrays, rng.standard_normal(50), trace)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.npz"


def orbit_of(small_orbit):
    return small_orbit.data, small_orbit.instrument


def test_state_survives_the_checkpoint(small_orbit, path, state):
    first = resume_from(path, *orbit_of(small_orbit), SETTINGS)
    assert first.state is None
    first.keep(state)
    found = resume_from(path, *orbit_of(small_orbit), SETTINGS).state
    assert (found.step, found.cycle, found.trace) == (state.step, state.cycle, state.trace)
    for name in ("theta", "sources", "scale", "losses"):
        np.testing.assert_array_equal(getattr(found, name), getattr(state, name))
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_checkpoint_of_other_settings_or_another_instrument_is_refused(small_orbit, path, state):
    resume_from(path, *orbit_of(small_orbit), SETTINGS).keep(state)
    with pytest.raises(InputError, match="of this fit, found that of other files, settings"):
        resume_from(path, *orbit_of(small_orbit), SETTINGS.with_(order=4))
    other = replace(small_orbit.instrument, focal_length_um=4.4e6)
    with pytest.raises(InputError, match="or another instrument"):
        resume_from(path, small_orbit.data, other, SETTINGS)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not a checkpoint"])
def test_damaged_file_is_refused(small_orbit, path, content):
    path.write_bytes(content)
    with pytest.raises(InputError, match="expected the checkpoint of an svi run"):
        resume_from(path, *orbit_of(small_orbit), SETTINGS)
    assert path.read_bytes() == content


def test_truncated_file_is_refused(small_orbit, path, state):
    resume_from(path, *orbit_of(small_orbit), SETTINGS).keep(state)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="expected the checkpoint of an svi run"):
        resume_from(path, *orbit_of(small_orbit), SETTINGS)


def test_unwritable_path_is_refused_before_the_fit(small_orbit, tmp_path):
    with pytest.raises(InputError, match="found no folder"):
        resume_from(tmp_path / "none" / "run.npz", *orbit_of(small_orbit), SETTINGS)


def test_fit_resumes_from_the_file_in_another_process(small_orbit, path):
    """Another fitter, which shares nothing but the file, stands for the other process."""
    orbit = orbit_of(small_orbit)

    def cancel(row):
        if row.iteration == 100:
            raise CancelledError("now")

    with pytest.raises(CancelledError):
        OrbitFitter(*orbit).fit(SETTINGS, cancel, resume_from(path, *orbit, SETTINGS))
    iterations = []
    result = OrbitFitter(*orbit).fit(
        SETTINGS,
        lambda row: iterations.append(row.iteration),
        resume_from(path, *orbit, SETTINGS),
    )
    assert iterations == [125, 150]
    assert len(result.losses) == 150
