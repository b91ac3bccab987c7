"""Progress of a job as one line on standard error."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from plateviz.solving.job import Job, JobStatus

_ERRORS = Console(stderr=True)


class Reporter:
    """A line of progress for work in this process or in the solver process."""

    def __init__(self, progress: Progress, title: str) -> None:
        """Add the line."""
        self._progress = progress
        self._task = progress.add_task(title, total=None)

    def step(self, done: int, total: int) -> None:
        """Show `done` of `total`."""
        self._progress.update(self._task, completed=done, total=total)

    def say(self, text: str) -> None:
        """Show the current activity."""
        self._progress.update(self._task, description=text)

    def follow(self, job: Job) -> JobStatus:
        """Show the progress of a job until it is over."""
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
    """Yield a line of progress on standard error, which is removed at the end."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=_ERRORS, transient=True) as progress:
        yield Reporter(progress, title)
