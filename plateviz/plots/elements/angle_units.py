"""Figures and texts in one unit of angles: mas, µas, or thousandths of a pixel.

Plots choose the unit of each number, and write it behind the number and in the labels of axes. A
unit that a person chooses is put in its place here, so that plots need not know of it.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from plateviz.figures.figure import Axis, Figure, Frame, Glyphs, Look, Ramp, Tooltips
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.elements.units import number_text
from solver.data.instrument import Instrument
from solver.units import MPIX_PER_PIX, RAD_PER_MAS, UAS_PER_MAS

Unit = Literal["mas", "µas", "mpix"]
_MOST_DECIMALS = 8

_UNITS = r"(mas|µas|mpix)"
# Not an area, and not the beginning of another word.
_END = r"(?![²\w])"
_NUMBER = r"[−-]?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?"
_NUMBERS = re.compile(rf"({_NUMBER}(?:(?:, | ± | to ){_NUMBER})*) {_UNITS}{_END}")
_ONE = re.compile(_NUMBER)
_TWICE = re.compile(rf"({_NUMBER} {_UNITS}) = {_NUMBER} \2{_END}")
_IN_LABEL = re.compile(rf"(?<=\(){_UNITS}(?=[,)/])|^{_UNITS}$")
_FIELD = re.compile(r"@\{(\w+)\}(\{[^}]*\})?")
# Place of the pointer, which is in the unit of the axis.
_POINTER = re.compile(rf"(\$[xy](?:\{{[^}}]*\}})?) {_UNITS}{_END}")
_FIELDS = re.compile(rf"((?:@\{{\w+\}}(?:\{{[^}}]*\}})?(?:, | ± | to )?)+) {_UNITS}{_END}")
_UNIT_COLUMN = re.compile(r"(?<=\} )@\{(\w+)\}(?!\{)")
_TWO_FIELDS = re.compile(rf"(@.+) {_UNITS} = @.+ \2$")
_ALONG: Mapping[str, tuple[str, ...]] = {
    "x": ("x", "x0", "x1", "xs", "left", "right", "dw"),
    "y": ("y", "y0", "y1", "y2", "ys", "bottom", "top", "dh"),
}


@dataclass(frozen=True)
class AngleUnits:
    """A unit, and what is needed to convert the others to it.

    Attributes
    ----------
    unit : of all angles
    mas_per_pixel : angle that one pixel sees
    """

    unit: Unit
    mas_per_pixel: float

    def factor(self, unit: str) -> float:
        """Return the factor from "mas", "µas" or "mpix" to the unit."""
        return self._in_mas(unit) / self._in_mas(self.unit)

    def figure(self, figure: Figure) -> Figure:
        """Return a figure with its angles, and residuals in mpix, in the unit.

        Areas (mpix²), and lengths in other units, stay as they are.
        """
        return replace(figure, frames=tuple(map(self._frame, figure)))

    def text(self, text: str) -> str:
        """Return a text with the unit behind the numbers that have one of the units."""
        return _TWICE.sub(r"\1", _NUMBERS.sub(lambda found: self._numbers(*found.groups()), text))

    def of_axes(self, frame: Frame) -> tuple[float, float]:
        """Return the factors from the units of a frame's axes, x and y, to the unit."""
        return self._of_label(frame.x.label), self._of_label(frame.y.label)

    def row(self, label: str, *texts: str) -> tuple[str, ...]:
        """Return the row of a table whose label has the unit of its numbers in brackets."""
        factor = self._of_label(label)
        if factor != 1.0:
            texts = tuple(_ONE.sub(lambda one: _scaled_text(one[0], factor), one) for one in texts)
        return self.label(label), *texts

    def label(self, label: str) -> str:
        """Return the label of an axis or a column, "offset (mas)" or "mas", with the unit."""
        return _IN_LABEL.sub(self.unit, label)

    def _in_mas(self, unit: str) -> float:
        sizes = {"mas": 1.0, "µas": 1.0 / UAS_PER_MAS, "mpix": self.mas_per_pixel / MPIX_PER_PIX}
        return sizes[unit]

    def _numbers(self, numbers: str, unit: str) -> str:
        factor = self.factor(unit)
        if factor == 1.0:
            return f"{numbers} {self.unit}"
        return f"{_ONE.sub(lambda one: _scaled_text(one[0], factor), numbers)} {self.unit}"

    def _frame(self, frame: Frame) -> Frame:
        factors = dict(zip("xy", self.of_axes(frame), strict=True))
        return replace(
            frame,
            glyphs=tuple(self._glyphs(one, factors) for one in frame.glyphs),
            title=self.text(frame.title),
            subtitle=self.text(frame.subtitle),
            x=self._axis(frame.x, factors["x"]),
            y=self._axis(frame.y, factors["y"]),
        )

    def _of_label(self, label: str | None) -> float:
        found = _IN_LABEL.search(label or "")
        return 1.0 if found is None else self.factor(found[0])

    def _axis(self, axis: Axis, factor: float) -> Axis:
        if factor == 1.0:
            return replace(axis, label=self.label(axis.label))
        low, high = (factor * limit for limit in axis.limits)
        ticks = axis.ticks
        if ticks:
            ticks = log_ticks((low, high)) if axis.is_log else None
        return replace(axis, label=self.label(axis.label), limits=(low, high), ticks=ticks)

    def _glyphs(self, glyphs: Glyphs, of_axes: Mapping[str, float]) -> Glyphs:
        hover = _with_units(glyphs)
        factors = {
            glyphs.at[at]: of_axes[axis]
            for axis, names in _ALONG.items()
            for at in names
            if at in glyphs.at
        }
        for look in glyphs.looks.values():
            if isinstance(look, Ramp) and look.label is not None:
                factors[look.column] = self._of_label(look.label)
        for _, text in hover:
            for fields, unit in _FIELDS.findall(text):
                factors |= dict.fromkeys(_names(fields), self.factor(unit))
        scaled = [name for name, factor in factors.items() if factor != 1.0]
        columns = {
            name: _scaled(values, factors.get(name, 1.0)) for name, values in glyphs.columns.items()
        }
        if glyphs.kind == "texts":
            name = glyphs.at["text"]
            texts = [self.text(str(text)) for text in columns[name]]
            columns[name] = np.array(texts, dtype=object)
        return replace(
            glyphs,
            columns=columns,
            looks={name: self._look(look, factors) for name, look in glyphs.looks.items()},
            hover=[(label, self._hover(text)) for label, text in hover],
            label=self.text(glyphs.label),
            units={**glyphs.units, **dict.fromkeys(scaled, self.unit)},
        )

    def _look(self, look: Look, factors: Mapping[str, float]) -> Look:
        factor = factors.get(look.column, 1.0) if isinstance(look, Ramp) else 1.0
        if not isinstance(look, Ramp) or factor == 1.0:
            return look
        label = None if look.label is None else self.label(look.label)
        low, high = look.limits
        return replace(look, limits=(factor * low, factor * high), label=label)

    def _hover(self, text: str) -> str:
        def scaled(found: re.Match[str]) -> str:
            digits = -round(math.log10(self.factor(found[2])))
            fields = _FIELD.sub(lambda one: _with_decimals(one[1], one[2] or "", digits), found[1])
            return f"{fields} {self.unit}"

        text = _POINTER.sub(rf"\1 {self.unit}", text)
        return _TWO_FIELDS.sub(r"\1 \2", _FIELDS.sub(scaled, text))


def mas_per_pixel(instrument: Instrument) -> float:
    """Return the angle that a pixel sees: mean pitch of the detectors over the focal length."""
    pitches = [(one.pitch_x_um, one.pitch_y_um) for one in instrument.detectors]
    return float(np.mean(pitches)) / instrument.focal_length_um / RAD_PER_MAS


def _with_units(glyphs: Glyphs) -> Tooltips:
    """Return the hover with units in place of columns that have one unit in all rows."""

    def unit(found: re.Match[str]) -> str:
        texts = set(map(str, glyphs.columns[found[1]]))
        return texts.pop() if len(texts) == 1 else found[0]

    return [(label, _UNIT_COLUMN.sub(unit, text)) for label, text in glyphs.hover]


def _names(fields: str) -> list[str]:
    return [name for name, _ in _FIELD.findall(fields)]


def _with_decimals(name: str, form: str, digits: int) -> str:
    before, point, decimals = form.strip("{}").partition(".")
    if not point:
        return f"@{{{name}}}{form}"
    n = min(max(len(decimals) + digits, 0), _MOST_DECIMALS)
    return f"@{{{name}}}{{{before}{'.' * (n > 0)}{'0' * n}}}"


def _scaled_text(text: str, factor: float) -> str:
    """Return a number times a factor, to as many digits."""
    digits = len(re.sub(r"e.*|\D", "", text).lstrip("0"))
    value = float(text.replace(",", "").replace("−", "-"))
    return number_text(factor * value, max(digits, 2))


def _scaled(values: np.ndarray, factor: float) -> np.ndarray:
    if factor == 1.0:
        return values
    if values.dtype != object:
        return factor * values
    # Cells of an image, and points of paths, are arrays in an array.
    found = np.empty(len(values), dtype=object)
    for number, one in enumerate(values):
        found[number] = factor * np.asarray(one, dtype=float)
    return found
