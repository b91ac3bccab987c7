"""Tables sent over SAMP: to a hub of astropy on this machine, and to none elsewhere."""

import socket
import time
import warnings

import numpy as np
import pytest
from astropy.table import Table
from astropy.utils.exceptions import AstropyDeprecationWarning

from plateviz.dashboard.saving import samp
from plateviz.dashboard.saving.samp import Hub, local_hub, send_table
from plateviz.dashboard.saving.table_sender import TableSender
from solver.errors import InputError

with warnings.catch_warnings():
    warnings.simplefilter("ignore", AstropyDeprecationWarning)
    programs = pytest.importorskip("astropy.samp")

URL, SECRET = "samp.hub.xmlrpc.url", "samp.secret"


@pytest.fixture
def lock_file(tmp_path, monkeypatch):
    path = tmp_path / "lock file"
    monkeypatch.setenv("SAMP_HUB", f"std-lockurl:{path.as_uri()}")
    return path


@pytest.fixture
def hub(tmp_path, monkeypatch):
    """A hub on the loopback interface, without a profile for web pages."""
    lock_file = tmp_path / "samp"
    monkeypatch.setenv("SAMP_HUB", f"std-lockurl:{lock_file.as_uri()}")
    monkeypatch.setattr(programs.conf, "use_internet", False)
    server = programs.SAMPHubServer(web_profile=False, lockfile=str(lock_file), addr="127.0.0.1")
    server.start()
    yield server
    server.stop()


@pytest.fixture
def receiver(hub):
    """A program that takes tables: what it was given, and what it answers."""
    client = programs.SAMPIntegratedClient("A program", addr="127.0.0.1")
    client.connect(hub_params=dict(hub.params))
    given, answers = [], [{"samp.status": "samp.ok", "samp.result": {}}]

    def take(private_key, sender_id, message_id, mtype, parameters, extra):
        given.append(parameters)
        # The hub of astropy forgets an answer that comes before it has noted the call.
        while message_id not in hub._sync_msg_ids_heap:
            time.sleep(0.001)
        if answers[-1] is not None:
            client.reply(message_id, answers[-1])

    client.bind_receive_call("table.load.votable", take)
    yield given, answers
    client.disconnect()


@pytest.fixture
def table():
    made = Table({"source_id": np.array([2**60, 7]), "ra": [266.1, 266.2]})
    made["ra"].unit, made["ra"].meta["ucd"] = "deg", "pos.eq.ra;meta.main"
    return made


def test_sent_table_is_received_and_removed_with_the_session(receiver, table):
    given, answers = receiver
    sender = TableSender()
    assert sender.send(table, "orbit-3-selection") == "2 sources sent to A program."
    (parameters,) = given
    assert parameters["name"] == "orbit-3-selection"
    assert parameters["url"].startswith("file:///")
    read = Table.read(parameters["url"], format="votable")
    assert read["source_id"].tolist() == [2**60, 7]
    assert (str(read["ra"].unit), read["ra"].meta["ucd"]) == ("deg", "pos.eq.ra;meta.main")
    folder = sender._folder.path
    assert folder.is_dir()
    assert folder.stat().st_mode & 0o777 == 0o700
    error = {"samp.errortxt": "no memory"}
    answers.append({"samp.status": "samp.error", "samp.result": {}, "samp.error": error})
    said = sender.send(table[:1], "orbit-3-selection")
    assert said == "1 source sent to A program (which answers: no memory)."
    sender.close()
    assert not folder.exists()


def test_program_that_is_silent_is_not_waited_for(receiver, table, monkeypatch):
    _, answers = receiver
    answers.append(None)
    monkeypatch.setattr(samp, "_ANSWER_SECONDS", 1)
    assert TableSender().send(table, "one") == "2 sources sent to A program (no answer yet)."


def test_hub_without_a_program_that_takes_tables_is_told(hub, table):
    with pytest.raises(InputError, match="no program that takes tables is connected"):
        TableSender().send(table, "one")
    # Nothing of plateviz stays registered.
    assert len(hub._private_keys) == 1


@pytest.mark.usefixtures("lock_file")
def test_no_hub_is_told(table):
    with pytest.raises(InputError, match="no SAMP hub runs on this machine; TOPCAT starts one"):
        TableSender().send(table, "one")


def test_hub_that_has_ended_is_told(lock_file, table):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    lock_file.write_text(f"# SAMP\n{SECRET}=a\n{URL}=http://127.0.0.1:{port}/\n")
    with pytest.raises(InputError, match=r"does not answer \(ConnectionRefusedError\)"):
        TableSender().send(table, "one")


def test_hub_that_is_silent_is_not_waited_for(monkeypatch, tmp_path):
    monkeypatch.setattr(samp, "_SECONDS", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        hub = Hub(f"http://127.0.0.1:{silent.getsockname()[1]}/", "a")
        with pytest.raises(InputError, match=r"does not answer \(TimeoutError\)"):
            send_table(tmp_path / "one.vot", "one", hub)


@pytest.mark.parametrize(
    "url",
    [
        # An address for documents, which no machine has.
        "http://192.0.2.1:8000/",
        "https://127.0.0.1:8000/",
        "file:///etc/passwd",
        "http://127.0.0.1:port/",
        "http://[::1/",
        "http:",
    ],
)
def test_hub_that_is_not_of_this_machine_is_refused(lock_file, url):
    lock_file.write_text(f"{SECRET}=a\n{URL}={url}\n")
    with pytest.raises(InputError, match="expected a SAMP hub on this machine, found one at"):
        local_hub()


def test_hub_of_this_machine_is_found(lock_file, monkeypatch, tmp_path):
    lock_file.write_text(f"#comment=1\n{SECRET}=a=b\n{URL}=http://localhost:8000/xmlrpc\n")
    found = Hub("http://localhost:8000/xmlrpc", "a=b")
    assert local_hub() == found
    monkeypatch.setattr(samp.Path, "home", lambda: tmp_path)
    lock_file.rename(tmp_path / ".samp")
    assert local_hub({}) == found


@pytest.mark.parametrize("given", ["http://192.0.2.1/.samp", "file://elsewhere/.samp", "/home/me"])
def test_lock_file_elsewhere_is_refused(given):
    with pytest.raises(InputError, match="SAMP_HUB: expected the lock file of a hub on this"):
        local_hub({"SAMP_HUB": f"std-lockurl:{given}"})


@pytest.mark.parametrize("content", ["", "samp.secret=a\n", "no lock file\n"])
def test_damaged_lock_file_is_refused(lock_file, content):
    lock_file.write_text(content)
    with pytest.raises(InputError, match="expected the address and the secret of a SAMP hub"):
        local_hub()
