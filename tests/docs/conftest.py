"""A folder with the files named in the pages: OBS.fits, REF.fits, RESULT.fits and a survey."""

import shutil
import sys

import pytest
from astropy.io import fits
from astropy.table import Table

from plateviz.cli.main import main
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT
from solver.fit import fit_orbit
from solver.io.result import write_result
from solver.io.survey import read_survey_orbit
from tests.docs.pages import REPOSITORY, built_site
from tests.fitting import fitting_in_this_process


@pytest.fixture(scope="session")
def stock(small_survey, tmp_path_factory):
    """The files, written once."""
    folder = tmp_path_factory.mktemp("stock")
    shutil.copytree(small_survey, folder / "DIR")
    data = read_survey_orbit(small_survey, 0)
    tables = [
        _hdu(data.measurements, MEASUREMENT),
        _hdu(data.exposures, ENVIRONMENT),
    ]
    fits.HDUList([fits.PrimaryHDU(), *tables]).writeto(folder / "OBS.fits")
    fits.HDUList([fits.PrimaryHDU(), _hdu(data.catalogue, CATALOGUE)]).writeto(folder / "REF.fits")
    write_result(fit_orbit(data), folder / "RESULT.fits")
    return folder


@pytest.fixture
def workplace(stock, tmp_path, monkeypatch):
    """A copy of them in the current folder."""
    folder = tmp_path / "work"
    shutil.copytree(stock, folder)
    (folder / "PASSWORD").write_text("seven red plates\n")
    monkeypatch.chdir(folder)
    # The solver process must use the checkout too, not an installed copy.
    monkeypatch.setenv("PYTHONPATH", str(REPOSITORY))
    return folder


@pytest.fixture
def command(workplace, monkeypatch):
    """Return the function that runs a command line in this process and returns its exit code.

    It fits surveys there, too; nothing is served or opened.
    """
    monkeypatch.setattr("plateviz.cli.serve.run_server", lambda store, *_: store.close())

    def run(words):
        monkeypatch.setattr(sys, "argv", words)
        with fitting_in_this_process(), pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code or 0

    return run


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The site, built once."""
    return built_site(tmp_path_factory)


def _hdu(frame, table):
    raw = Table.from_pandas(frame[table.names])
    for column in table:
        raw[column.name].unit = column.unit or None
    hdu = fits.table_to_hdu(raw)
    hdu.name = table.name
    return hdu
