"""The nuts engine: samples of the exact posterior, to check the other engines.

Every sample costs about a dozen passes over the measurements, so this engine is meant for orbits
thinned to a fraction of their sources. It moves in coordinates whitened at the mode
(`solver.linear.whitening`), where the posterior is nearly a unit ball and needs no mass matrix.
"""

import importlib
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from numpyro.diagnostics import effective_sample_size, split_gelman_rubin
from numpyro.infer import MCMC, NUTS

from solver.data.engine_settings import NutsSettings
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.curvature import curvature_at
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Iteration, Mode, find_mode
from solver.engines.numpyro_model import (
    CALIBRATION,
    FREE_SOURCES,
    ModelInput,
    in_coordinates,
    model_input,
)
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.linear.whitening import Coordinates, whitened
from solver.problem.problem import Problem

# Maximum number of samples between two reports.
_BLOCK = 250
# Largest R-hat of chains that agree (Vehtari et al. 2021), raised a little for the maximum
# over many parameters.
_LARGEST_R_HAT = 1.05
_SITES = (CALIBRATION, FREE_SOURCES)
_EXTRA_FIELDS = ("num_steps", "potential_energy", "diverging")


class Chains(NamedTuple):
    """Samples of the free coordinates, with the number of divergences and leapfrog steps."""

    calibration: Float[np.ndarray, "chain sample calib"]
    sources: Float[np.ndarray, "chain sample 2 src"]
    diverging: int
    steps: int


class _Mixing(NamedTuple):
    """Worst mixing numbers of all parameters, and the library that computed them.

    `of_sigmas` is the effective sample size of the standard deviations.
    """

    r_hat: float
    effective_samples: float
    of_sigmas: float
    by: str


def sample(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> Estimate:
    """Sample the posterior, starting near its mode.

    Parameters
    ----------
    progress : called after every block of samples; an exception it raises stops the fit

    Returns
    -------
    The mean of the samples with their covariances; conditional covariances come from the
    problem linearised there. `entries` has divergences, R-hat and effective sample size.
    """
    begin, options = time.perf_counter(), settings.nuts
    start = find_mode(problem, settings)
    if start.reduced is None:
        return Estimate(start)
    curvature = curvature_at(problem, start, start.reduced)
    coordinates, trace = replace(whitened(start.reduced), curvature=curvature), list[Iteration]()

    def report(done: int, chi2: float) -> None:
        elapsed = time.perf_counter() - begin
        trace.append(Iteration(done, chi2, float("nan"), float("nan"), "", 0.0, elapsed))
        progress(trace[-1])

    chains = _run_chains(model_input(problem), coordinates, options, report)
    mixing = _mixing(chains)
    mixed = chains.diverging == 0 and not mixing.r_hat > _LARGEST_R_HAT
    status = FitStatus.SAMPLED if mixed else FitStatus.UNMIXED
    theta, sources = _as_offsets(coordinates, chains)
    at = theta.mean(axis=0), sources.mean(axis=0)
    equations = accumulate(problem, *at)
    residual = sources - at[1]
    return Estimate(
        Mode(*at, eliminate_sources(equations, problem.priors), status, trace, equations),
        marginal=np.einsum("nsa,nsb->sab", residual, residual) / (len(residual) - 1),
        calibration=np.cov(theta, rowvar=False),
        entries=_entries(chains, mixing, options),
    )


def _run_chains(
    inputs: ModelInput,
    coordinates: Coordinates,
    options: NutsSettings,
    report: Callable[[int, float], None],
) -> Chains:
    kernel = NUTS(in_coordinates, adapt_mass_matrix=False)
    block = -(-options.samples // -(-options.samples // _BLOCK))
    arguments = jax.device_put((inputs, coordinates))
    blocks: list[list[Mapping[str, np.ndarray]]] = []
    keys = jax.random.split(jax.random.key(options.seed), options.chains)
    shapes = {
        CALIBRATION: coordinates.origin[0].shape,
        FREE_SOURCES: coordinates.origin[1].T.shape,
    }
    engine = MCMC(
        kernel,
        num_warmup=options.warmup,
        num_samples=block,
        progress_bar=False,
        jit_model_args=True,
    )
    for chain, key in enumerate(keys):
        # The starting points of the chains scatter like samples.
        scattered = {
            name: jax.random.normal(jax.random.fold_in(key, i), shapes[name])
            for i, name in enumerate(_SITES)
        }
        engine.post_warmup_state = None
        blocks.append([])
        for first in range(0, options.samples, block):
            engine.run(key, *arguments, init_params=scattered, extra_fields=_EXTRA_FIELDS)
            engine.post_warmup_state = engine.last_state
            key = engine.last_state.rng_key  # noqa: PLW2901 continues the chain's own sequence
            fields = engine.get_extra_fields()
            blocks[-1].append(jax.tree.map(np.asarray, {**engine.get_samples(), **fields}))
            done = chain * options.samples + first + block
            report(done, 2.0 * float(fields["potential_energy"].mean()))
    return _concatenated(blocks, options.samples)


def _concatenated(blocks: list[list[Mapping[str, np.ndarray]]], count: int) -> Chains:
    def joined(name: str) -> np.ndarray:
        return np.stack(
            [np.concatenate([block[name] for block in chain])[:count] for chain in blocks]
        )

    return Chains(
        joined(CALIBRATION),
        joined(FREE_SOURCES),
        int(joined("diverging").sum()),
        int(joined("num_steps").sum()),
    )


def _as_offsets(
    coordinates: Coordinates, chains: Chains
) -> tuple[Float[np.ndarray, "sample calib"], Float[np.ndarray, "sample src 2"]]:
    """Return all samples as offsets from the origins."""
    samples = (np.concatenate(values) for values in (chains.calibration, chains.sources))
    theta, sources = jax.lax.map(lambda free: coordinates.place(*free), tuple(samples))
    return np.asarray(theta), np.asarray(sources)


def _mixing(chains: Chains) -> _Mixing:
    """Return the worst R-hat and effective sample size, from ArviZ if it is installed."""
    n_chains, n_samples = chains.calibration.shape[:2]
    flat = chains.sources.reshape(n_chains, n_samples, -1)
    free = np.concatenate([chains.calibration, flat], axis=-1)
    squares = (free - free.mean(axis=(0, 1))) ** 2
    try:
        arviz = importlib.import_module("arviz")
    except ImportError:
        return _Mixing(
            float(np.max(split_gelman_rubin(free))),
            float(np.min(effective_sample_size(free))),
            float(np.min(effective_sample_size(squares))),
            "numpyro",
        )
    data = arviz.convert_to_dataset({"free": free, "squares": squares})
    ess = arviz.ess(data)
    return _Mixing(
        float(arviz.rhat(data)["free"].max()),
        float(ess["free"].min()),
        float(ess["squares"].min()),
        "ArviZ",
    )


def _entries(chains: Chains, mixing: _Mixing, options: NutsSettings) -> dict[str, object]:
    return {
        "chains": options.chains,
        "samples": options.chains * options.samples,
        "divergences": chains.diverging,
        "largest_r_hat": mixing.r_hat,
        "smallest_effective_samples": mixing.effective_samples,
        "smallest_effective_samples_of_sigmas": mixing.of_sigmas,
        "mixing_by": mixing.by,
        "leapfrog_steps": chains.steps,
    }
