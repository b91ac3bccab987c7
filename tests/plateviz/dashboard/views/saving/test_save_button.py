"""SaveButton: a choice is made into a file, or says why not."""

import json
import threading
import time
from types import SimpleNamespace

import panel as pn
import pytest

from plateviz.dashboard.saving.downloads import Download, Later
from plateviz.dashboard.views.saving.save_button import Picture, SaveButton
from plateviz.solving.turns import Turns
from solver.errors import InputError


def fail():
    raise InputError("there is nothing to save yet")


CHOICES = {
    "CSV": lambda: Download("a.csv", b"x"),
    "PNG": lambda: Picture("a.png", {"doc": 1}),
    "FITS": fail,
}


@pytest.fixture
def sent(monkeypatch):
    messages = []
    monkeypatch.setattr(SaveButton, "_send_msg", lambda _, message: messages.append(message))
    return messages


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ("CSV", {"name": "a.csv", "content": b"x"}),
        ("PNG", {"name": "a.png", "item": json.dumps({"doc": 1})}),
        ("FITS", {"text": "It could not be saved: there is nothing to save yet."}),
    ],
)
def test_choice_is_sent(sent, choice, message):
    SaveButton("A figure", CHOICES)._handle_msg(choice)
    assert sent == [message]


@pytest.mark.parametrize("message", ["TIFF", None, {"label": "CSV"}, ["CSV"], 3])
def test_message_that_is_no_choice_is_ignored(sent, message):
    SaveButton("A figure", CHOICES)._handle_msg(message)
    assert sent == []


class Page:
    """The document of a page, whose thread runs what is asked for at once."""

    session_context = SimpleNamespace(request=SimpleNamespace(arguments={}))

    def add_next_tick_callback(self, act):
        act()


def test_file_that_takes_long_is_made_on_a_thread_and_one_at_a_time(sent, monkeypatch):
    def make(progress):
        progress(1, 2)
        has_begun.set()
        assert may_end.wait(10.0)
        threads.append(threading.current_thread())
        return Download("a.html", b"x")

    has_begun, may_end, threads = threading.Event(), threading.Event(), []
    monkeypatch.setattr(type(pn.state), "curdoc", Page())
    button = SaveButton("A report", {"HTML": lambda: Later(make)})
    button._handle_msg("HTML")
    assert has_begun.wait(10.0)
    button._handle_msg("HTML")
    may_end.set()
    until(lambda: {"name": "a.html", "content": b"x"} in sent)
    assert sent[:2] == [
        {"text": "Being saved … 1 of 2", "more": True},
        {"text": "The one before is not done yet.", "more": True},
    ]
    assert threads[0] is not threading.main_thread()
    until(lambda: not button._is_making)
    button._handle_msg("HTML")
    until(lambda: len(sent) == 5)


def test_file_that_waits_for_those_of_other_pages_says_its_place(sent, monkeypatch):
    monkeypatch.setattr(type(pn.state), "curdoc", Page())
    turns = Turns()
    choices = {"HTML": lambda: Later(lambda _: Download("a.html", b"x"), turns)}
    buttons = [SaveButton("A report", choices) for _ in range(2)]
    with turns.turn(pytest.fail):
        for button, words in zip(buttons, ("the one", "the 2"), strict=True):
            button._handle_msg("HTML")
            text = f"Waiting for {words} of other pages before it …"
            until(lambda told={"text": text, "more": True}: told in sent)
    until(lambda: sent.count({"name": "a.html", "content": b"x"}) == 2)


def test_file_that_waits_is_not_made_once_its_page_is_closed(sent, monkeypatch):
    page, turns, made = Page(), Turns(), []
    monkeypatch.setattr(type(pn.state), "curdoc", page)
    choices = {"HTML": lambda: Later(lambda _: made.append("a.html"), turns)}
    button = SaveButton("A report", choices)
    with turns.turn(pytest.fail):
        button._handle_msg("HTML")
        until(lambda: sent)
        page.session_context = None
    until(lambda: not button._is_making)
    assert made == []


def test_file_that_cannot_be_made_is_told(sent, monkeypatch):
    def fail(_):
        raise InputError("orbits are missing")

    monkeypatch.setattr(type(pn.state), "curdoc", Page())
    SaveButton("A report", {"HTML": lambda: Later(fail)})._handle_msg("HTML")
    until(lambda: sent == [{"text": "It could not be saved: orbits are missing."}])


@pytest.mark.parametrize(
    "error",
    [KeyError("Δα"), OSError("no space"), ValueError("not ASCII"), RuntimeError("lost")],
    ids=lambda error: type(error).__name__,
)
@pytest.mark.parametrize("is_later", [False, True], ids=["at once", "later"])
def test_error_that_nobody_expects_is_logged_and_told(sent, monkeypatch, caplog, error, is_later):
    def fail(*_):
        raise error

    monkeypatch.setattr(type(pn.state), "curdoc", Page())
    choices = {"FITS": (lambda: Later(fail)) if is_later else fail}
    SaveButton("A figure", choices)._handle_msg("FITS")
    until(lambda: sent)
    (message,) = sent
    assert message["text"].startswith(f"It could not be saved: {type(error).__name__}: {error}. ")
    (record,) = caplog.records
    assert record.getMessage() == "A figure: a file cannot be made"
    assert record.exc_info[1] is error


def until(holds):
    deadline = time.monotonic() + 10.0
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.005)
