"""The terms of the Legendre distortion, in the order of its parameters."""


def terms(order: int) -> list[tuple[int, int]]:
    """Return the degrees (k, l) of the terms up to `order`.

    They are sorted by total degree, then by decreasing degree in x, so that the terms of a
    lower order come first.
    """
    return [(n - j, j) for n in range(2, order + 1) for j in range(n + 1)]
