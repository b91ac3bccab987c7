"""The device that JAX computes on, CPU or accelerator, as chosen by JAX_PLATFORMS.

The solver uses JAX's default device. Results are converted to NumPy arrays, and the dense
linear algebra is done by NumPy's BLAS.
"""

import jax

from solver.errors import InputError


def require_device() -> str:
    """Return the platform that JAX computes on, such as "cpu" or "gpu".

    Raises
    ------
    InputError
        If the requested device does not exist.
    """
    try:
        return jax.devices()[0].platform
    # JAX raises AssertionError if the plug-in of an accelerator is missing.
    except (RuntimeError, AssertionError) as error:
        reason = str(error).partition("\n")[0] or "JAX has no such device"
        raise InputError(
            f"JAX_PLATFORMS: expected a device that JAX can compute on here, "
            f"found {jax.config.values['jax_platforms']!r}: {reason}"
        ) from error
