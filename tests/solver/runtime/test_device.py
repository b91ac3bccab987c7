import os
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest

from solver.linear.leverage import residuals
from solver.linear.normal_equations import accumulate
from solver.runtime.device import require_device

REPOSITORY = Path(__file__).resolve().parents[3]

# A fit on the second of two devices, which records the devices used.
ON_ANOTHER_DEVICE = """
import jax
from solver.linear import linearised_chunks as chunks
from solver.linear import chi2 as objective
from solver.fit import fit_orbit
from tests.solver.small_orbit import make_orbit

used = set()

def recording(compute):
    def wrapper(*arguments):
        found = compute(*arguments)
        used.update(*(array.devices() for array in jax.tree.leaves(found)))
        return found
    return wrapper

chunks.linearise = recording(chunks.linearise)
objective._value_and_gradient = recording(objective._value_and_gradient)
jax.config.update("jax_default_device", jax.devices()[1])
orbit = make_orbit()
summary = fit_orbit(orbit.data, orbit.instrument).summary
print(*(device.id for device in used), f"{summary['chi2']:.4f}")
"""


def run(*command, **variables):
    return subprocess.run(
        [sys.executable, *command],
        cwd=REPOSITORY,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
    )


def test_device_is_the_jax_backend():
    assert require_device() == jax.default_backend()


def test_command_refuses_a_device_that_is_absent(tmp_path):
    directory = tmp_path / "survey"
    done = run("-m", "plateviz.cli.main", "simulate", str(directory), JAX_PLATFORMS="nowhere")
    assert done.returncode == 2
    assert done.stderr.strip().count("\n") == 0
    assert "JAX_PLATFORMS: expected a device" in done.stderr
    assert "found 'nowhere'" in done.stderr
    assert not directory.exists()


def test_tests_refuse_a_device_that_is_absent():
    done = run("-m", "pytest", "--device", "nowhere", "tests/solver/model/test_detector.py")
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert (
        "JAX_PLATFORMS: expected a device that JAX can compute on here, found 'nowhere'"
        in done.stderr
    )
    assert "Traceback" not in done.stderr


@pytest.mark.full
def test_fit_uses_only_the_default_device(result):
    done = run(
        "-c",
        ON_ANOTHER_DEVICE,
        JAX_PLATFORMS="cpu",
        JAX_DISABLE_MOST_OPTIMIZATIONS="1",
        XLA_FLAGS="--xla_force_host_platform_device_count=2",
    )
    assert done.stdout.split() == ["1", f"{result.summary['chi2']:.4f}"], done.stderr


def test_results_are_float64_numpy_arrays(problem, solution):
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    found = accumulate(problem, theta, sources)
    found_residuals = residuals(
        solution.problem, solution.mode.theta, solution.mode.sources, solution.covariance
    )
    for array in (found.theta, found.source, found.cross, *found_residuals):
        assert type(array) is np.ndarray
        assert array.dtype == np.float64
