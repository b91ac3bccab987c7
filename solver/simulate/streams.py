"""Independent streams of random numbers, one for each purpose."""

from enum import IntEnum

import numpy as np


class Stream(IntEnum):
    """Independent random streams: the numbers of one do not depend on draws from another."""

    TRUTH = 0
    REFERENCE = 1
    DETECTORS = 2
    FIELDS = 3
    ATTITUDE = 4
    MEASUREMENTS = 5
    DEFECTS = 6
    MAGNITUDES = 7


def generator(seed: int, stream: Stream, *key: int) -> np.random.Generator:
    """Return the generator of a stream; different keys (such as orbits) are independent."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(stream), *key)))
