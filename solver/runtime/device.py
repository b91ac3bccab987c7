"""The device that JAX computes on, a processor or an accelerator: JAX_PLATFORMS chooses it.

Nothing in the solver asks for one by name. What it hands to JAX goes to JAX's default device,
and what comes back is NumPy's, in whose BLAS the dense algebra is done.
"""

import jax

from solver.errors import InputError


def require_device() -> str:
    """Return the platform that JAX computes on, such as "cpu" or "gpu".

    Raises
    ------
    InputError
        If there is none of the kind that was asked for.
    """
    try:
        return jax.devices()[0].platform
    # An assertion of JAX's own fails where the plug-in of an accelerator is missing.
    except (RuntimeError, AssertionError) as error:
        reason = str(error).partition("\n")[0] or "JAX has none such"
        raise InputError(
            f"JAX_PLATFORMS: expected a device that JAX can compute on here, "
            f"found {jax.config.values['jax_platforms']!r}: {reason}"
        ) from error
