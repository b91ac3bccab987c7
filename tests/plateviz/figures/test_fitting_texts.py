"""Texts inside a frame, made to fit its size."""

from dataclasses import replace

import numpy as np

from plateviz.figures.figure import Axis, framed, message
from plateviz.figures.fitting_texts import with_fitting_texts
from plateviz.figures.glyphs import texts
from plateviz.figures.text_width import text_width


def cells(width, *, is_log=False):
    places = np.tile(np.arange(1.0, 9.0), 3), np.repeat([1.0, 2.0, 3.0], 8)
    labels = texts(*places, ["1.0 arcsec"] * 24, name="moves", size="10px")
    axes = {"x": Axis("x", (0.5, 9.0), is_log=is_log), "y": Axis("y", (0.5, 3.5))}
    (frame,) = framed([labels], title="Cells", **axes, width=width, height=100)
    return with_fitting_texts(frame)["moves"].columns["text"]


def test_texts_that_would_overlap_are_left_out():
    assert set(cells(900)) == {"1.0 arcsec"}
    assert set(cells(300)) == {""}
    assert set(cells(900, is_log=True)) == {""}


def test_few_texts_stay():
    numbers = texts([1.0, 1.1], [1.0, 1.0], ["0", "1"], name="numbers", size="10px")
    axes = {"x": Axis("x", (0.0, 9.0)), "y": Axis("y", (0.0, 3.0))}
    (frame,) = framed([numbers], title="Cells", **axes, width=20, height=20)
    assert list(with_fitting_texts(frame)["numbers"].columns["text"]) == ["0", "1"]


def test_a_message_is_wrapped_to_its_frame():
    figure = message("Both", "Fit with other settings, or choose what to compare with.")
    narrow = with_fitting_texts(replace(figure[0], width=200))
    lines = str(narrow["message"].columns["text"][0]).split("\n")
    assert len(lines) > 1
    assert all(text_width(line, 13) <= 200 for line in lines)
    assert " ".join(lines) == figure.message


def test_text_that_is_longer_than_its_frame_ends_with_an_ellipsis():
    names = ["gradient of focal length with distortion A(0,2), A(2,0)", "common pointing"]
    labels = texts([0.0, 0.0], [1.0, 2.0], names, name="names", align="left")
    axes = {"x": Axis("x", (0.0, 1.0)), "y": Axis("y", (0.5, 2.5))}
    cut = {}
    for width in (900, 250, 20):
        (frame,) = framed([labels], title="Names", **axes, width=width, height=100)
        cut[width] = list(with_fitting_texts(frame)["names"].columns["text"])
    assert cut[900] == names
    assert cut[250] == ["gradient of focal length with distortion ...", "common pointing"]
    assert text_width(cut[250][0], 11) <= 250
    # Nothing is left to cut.
    assert cut[20] == names
