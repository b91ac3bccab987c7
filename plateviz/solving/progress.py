"""Progress of a job as one line on standard error."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from plateviz.solving.job import Job, JobStatus

_ERRORS = Console(stderr=True)


class Reporter:
    """A line of progress that work in this process or another one keeps up to date."""

    def __init__(self, progress: Progress, title: str) -> None:
        """Add the line."""
        self._progress = progress
        self._task = progress.add_task(title, total=None)

    def step(self, done: int, total: int) -> None:
        """Say how much is done."""
        self._progress.update(self._task, completed=done, total=total)

    def say(self, words: str) -> None:
        """Say what is being done."""
        self._progress.update(self._task, description=words)

    def follow(self, job: Job) -> JobStatus:
        """Report a job until it is over."""
        seen = 0
        while not job.status.is_over:
            job.wait_for_news(seen, timeout=1.0)
            reports = job.progress
            for report in reports[seen:]:
                self.say(str(report.get("stage", "")))
                if "total" in report:
                    self.step(int(str(report["done"])), int(str(report["total"])))
            seen = len(reports)
        return job.status


@contextmanager
def reporting(title: str) -> Iterator[Reporter]:
    """Give a line of progress on standard error; it is gone when the work is done."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=_ERRORS, transient=True) as progress:
        yield Reporter(progress, title)
