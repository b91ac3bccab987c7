"""An executor whose work is done when a test says so."""

from concurrent.futures import Executor, Future


class Waiting(Executor):
    """Keeps what is to be run."""

    def __init__(self):
        self.waiting = []

    def submit(self, work, /, *arguments):
        self.waiting.append((work, arguments, Future()))
        return self.waiting[-1][2]

    def work(self):
        """Do all of it; what it raises becomes the answer."""
        for work, arguments, answer in self.waiting:
            try:
                answer.set_result(work(*arguments))
            except Exception as error:  # noqa: BLE001 as executors do
                answer.set_exception(error)
        self.waiting.clear()
