"""Legendre distortion of any order: ideal to distorted focal plane.

Paper, Eqs. (model:Lx, model:Ly, model:A0, model:B0, model:first). The first-order terms
are zero, since pointing, focal length and position angle describe them, and the constant
term is such that the optical centre is not displaced. Both conditions are satisfied by
using the terms L_k(x) L_l(y) - L_k(0) L_l(0) with total degree from 2 upwards.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from solver.data.distortion_terms import terms


def basis(
    x: Float[Array, "*obs"], y: Float[Array, "*obs"], order: int
) -> list[Float[Array, "*obs"]]:
    """Return the value of every distortion term, in the order of `terms`.

    Parameters
    ----------
    x, y : ideal focal-plane position times s, within [-1, 1] on the field
    order : highest total degree
    """
    in_x, in_y = _legendre(x, order), _legendre(y, order)
    at_zero = [np.polynomial.legendre.legval(0.0, row).item() for row in np.eye(order + 1)]
    return [in_x[k] * in_y[j] - at_zero[k] * at_zero[j] for k, j in terms(order)]


def _legendre(x: Float[Array, "*obs"], order: int) -> list[Float[Array, "*obs"]]:
    """Return L_0 ... L_order by Bonnet's recursion."""
    values = [jnp.ones_like(x), x]
    for n in range(1, order):
        higher, lower = (2 * n + 1) / (n + 1), n / (n + 1)
        values.append(higher * x * values[n] - lower * values[n - 1])
    return values
