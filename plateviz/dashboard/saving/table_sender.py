"""TableSender: gives tables of one session to the programs of this machine."""

from astropy.table import Table

from plateviz.dashboard.saving.samp import local_hub, send_table
from solver.data.plural import plural
from solver.io.disk import writing
from solver.io.scratch import ScratchFolder, temporary_folder
from solver.io.write_tables import write_tables


class TableSender:
    """Files of one session, which programs read when they like; removed with the session."""

    def __init__(self) -> None:
        """Begin without a file."""
        self._folder: ScratchFolder | None = None
        self._sent = 0
        self._is_closed = False

    def send(self, table: Table, name: str) -> str:
        """Give a table to the programs of the hub; return what was done, in words.

        Raises
        ------
        InputError
            If there is no hub, or no program that takes it.
        """
        hub = local_hub()
        temporary = temporary_folder()
        with writing(temporary, "to write the table"):
            if self._folder is None:
                self._folder = ScratchFolder(temporary, "plateviz-sent")
            self._sent += 1
            path = self._folder.path / f"{name}-{self._sent}.vot"
            write_tables({name: table}, path)
        takers = send_table(path, name, hub)
        if self._is_closed:
            self.close()
        counted = f"{len(table):,} {plural(len(table), 'source')}"
        return f"{counted} sent to {', '.join(takers)}."

    def close(self) -> None:
        """Remove the files."""
        self._is_closed = True
        if self._folder is not None:
            self._folder.close()
