"""Chunks of tiles, computed by JAX one after the other while the caller uses those before."""

from collections import deque
from collections.abc import Callable, Iterator
from typing import TypeVar

from solver.runtime.interruption import give_way

_Chunk = TypeVar("_Chunk")


def chunks_in_turn(launch: Callable[[int], _Chunk], count: int, ahead: int) -> Iterator[_Chunk]:
    """Yield each chunk in order; a fit may be interrupted between two of them.

    Parameters
    ----------
    launch : begins to compute the chunk of a number
    count : number of chunks
    ahead : maximum number of chunks that are computed while the caller uses one
    """
    pending = deque[_Chunk]()
    for number in range(count + ahead):
        give_way()
        if number < count:
            pending.append(launch(number))
        if number >= ahead and pending:
            yield pending.popleft()
