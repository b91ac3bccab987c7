"""Background: threads that work for all sessions, and tell who waits when something is done."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any
from weakref import WeakMethod

# Threads that read and count rows, beside the one of the event loop.
_READERS = 2


class Background(ThreadPoolExecutor):
    """An executor of which a page need not ask again and again whether it is done."""

    def __init__(self) -> None:
        """Begin without work."""
        super().__init__(_READERS, thread_name_prefix="reader")
        self._listeners: set[WeakMethod[Callable[[], object]]] = set()
        # Work may be done, in its own thread or at once, while somebody begins to listen.
        self._changing = threading.Lock()

    def submit(self, work: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:  # noqa: ANN401 as its base
        """Run something on one of the threads; return what will have its value."""
        future = super().submit(work, *arguments, **options)
        future.add_done_callback(self._tell)
        return future

    def listen(self, listener: Callable[[], object]) -> None:
        """Call a method once, from any thread, when the next work is done, however often it asks.

        The method's object, such as a page that has been closed, is not kept alive.
        """
        with self._changing:
            self._listeners.add(WeakMethod(listener))

    def _tell(self, _: Future[Any]) -> None:
        with self._changing:
            listeners, self._listeners = self._listeners, set()
        for reference in listeners:
            if (listener := reference()) is not None:
                listener()
