"""SaveButton: a choice is made into a file, or says why not."""

import json

import pytest

from plateviz.dashboard.downloads import Download
from plateviz.dashboard.views.save_button import Picture, SaveButton
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
        ("FITS", {"error": "It could not be saved: there is nothing to save yet."}),
    ],
)
def test_choice_is_sent(sent, choice, message):
    SaveButton("A figure", CHOICES)._handle_msg(choice)
    assert sent == [message]


@pytest.mark.parametrize("message", ["TIFF", None, {"label": "CSV"}, ["CSV"], 3])
def test_message_that_is_no_choice_is_ignored(sent, message):
    SaveButton("A figure", CHOICES)._handle_msg(message)
    assert sent == []
