"""A small local TAP service with a job queue, which answers ADQL with SQLite."""

import gzip
import io
import re
import sqlite3
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs

import numpy as np
from astropy.io import votable
from astropy.table import MaskedColumn, Table

from solver.simulate.gaia import GAIA
from solver.simulate.sky import icrs_to_galactic

SINGLE = ("ra_error", "dec_error", "parallax_error", "pmra_error", "pmdec_error")


def archive_table(stars):
    """Return stars with the additional columns of the archive."""
    l_deg, b_deg = icrs_to_galactic(stars["ra"].to_numpy(), stars["dec"].to_numpy())
    return stars.assign(
        l=l_deg % 360.0,
        b=b_deg,
        parallax_over_error=stars["parallax"] / stars["parallax_error"],
        phot_g_mean_mag=np.where(np.arange(len(stars)) % 50 == 0, np.nan, 15.0),
    )


class Service:
    """The answers of a service, and the queries that it received.

    Attributes
    ----------
    phases : states of the job in successive polls; the last one is repeated
    edit : changes the table of the answer
    finish : changes the bytes of the answer
    """

    def __init__(self, stars):
        self.phases = ["COMPLETED"]
        self.edit = self.finish = lambda answer: answer
        self.queries = []
        self.polls = 0
        self.database = sqlite3.connect(":memory:", check_same_thread=False)
        self.database.execute("ATTACH ':memory:' AS gaiadr3")
        self.database.create_function("POINT", 3, lambda _, ra, dec: f"{ra!r} {dec!r}")
        self.database.create_function("CIRCLE", 4, lambda _, *c: " ".join(map(repr, c)))
        self.database.create_function("CONTAINS", 2, contains)
        archive_table(stars).to_sql("gaia_source", self.database, index=False)
        # pandas writes into the main database, but ADQL names the attached one.
        self.database.execute("CREATE TABLE gaiadr3.gaia_source AS SELECT * FROM main.gaia_source")

    def select(self, query):
        """Return the column names and rows of a query."""
        top = re.search(r" TOP (\d+)", query)
        found = self.database.execute(query.replace(top[0], "") + f" LIMIT {top[1]}")
        return [item[0] for item in found.description], found.fetchall()

    def answer(self):
        """Return the answer to the last query as a compressed VOTable, as the archive does."""
        names, rows = self.select(self.queries[-1])
        table = Table()
        for name, values in zip(names, zip(*rows, strict=True), strict=True):
            table[self.spelling(name)] = column(name, values)
        buffer = io.BytesIO()
        votable.from_table(self.edit(table)).to_xml(buffer)
        return gzip.compress(self.finish(buffer.getvalue().replace(b"mas.yr-1", b"mas.yr**-1")))

    @staticmethod
    def spelling(name):
        return name.upper() if name == "source_id" else name


def contains(point, circle):
    """Return whether a point is in a circle, deg."""
    (ra, dec), (ra_0, dec_0, radius) = (
        np.radians(list(map(float, s.split()))) for s in (point, circle)
    )
    cosine = np.sin(dec) * np.sin(dec_0) + np.cos(dec) * np.cos(dec_0) * np.cos(ra - ra_0)
    return int(cosine >= np.cos(radius))


def column(name, values):
    if name == "phot_g_mean_mag":
        missing = [value is None for value in values]
        filled = [0.0 if value is None else value for value in values]
        return MaskedColumn(np.array(filled, np.float32), mask=missing, unit="mag")
    single = name in SINGLE or name.endswith("_corr")
    dtype = np.int64 if name == "source_id" else np.float32 if single else np.float64
    return MaskedColumn(np.array(values, dtype), unit=GAIA[name].unit or None)


@contextmanager
def serving(service):
    """Yield the address of a service that runs inside the block."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler(service))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/tap"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def handler(service):
    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"])).decode()
            service.queries.append(parse_qs(body)["QUERY"][0])
            service.polls = 0
            self.send_response(303)
            self.send_header("Location", f"{self.path}/17")
            self.send_header("Content-Length", "0")
            self.end_headers()

        def do_GET(self):
            pages = {
                "/tap/async/17/phase": self.phase,
                "/tap/async/17/results/result": service.answer,
                "/tap/async/17/error": lambda: b"<li><b>Message: </b>Cannot parse the query</li>",
            }
            page = pages.get(self.path)
            content = page() if page else b"no such page"
            self.send_response(200 if page else 404)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def phase(self):
            found = service.phases[min(service.polls, len(service.phases) - 1)]
            service.polls += 1
            return found.encode()

        def log_message(self, *_):
            """Suppress log messages."""

    return Handler
