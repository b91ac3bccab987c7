"""VectorLayout: columns of the calibration parameters in the flat vector the engines solve for.

Exposures come first, all groups of one exposure together with its walking distortion terms, then
the two directions of the distortion and of its optional terms, then the detectors, all groups of
one detector together, and last what moves from span to span. The parameters that one measurement
depends on therefore lie in few contiguous ranges.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Int, Shaped

from solver.data.detector_spans import motion_elements
from solver.data.parameter_group import TERM_AXES, Axis, Group
from solver.data.parameters import BY_NAME, CALIBRATION_GROUPS, PARAMETERS, groups_on

PER_EXPOSURE = groups_on("exp")
PER_COEFFICIENT = groups_on("coef")
PER_DETECTOR = groups_on("det")
# A NumPy or JAX array.
AnyArray = Any
_LOCAL_AXES: tuple[Axis, ...] = ("exp", "det", "motion")


def local_groups(names: Iterable[str]) -> tuple[Group, ...]:
    """Return the groups among `names` of which a measurement depends on one element each."""
    known = set(names)
    return tuple(
        group
        for axis in _LOCAL_AXES
        for group in PARAMETERS
        if group.axis == axis and group.name in known
    )


def walk_groups(names: Iterable[str]) -> tuple[Group, ...]:
    """Return the groups among `names` whose elements are terms at single exposures, x before y."""
    known = set(names)
    return tuple(group for group in PARAMETERS if group.axis == "walk" and group.name in known)


@dataclass(frozen=True)
class VectorLayout:
    """Sizes of the calibration axes and the columns that follow from them.

    Attributes
    ----------
    optional : names of the optional groups, in table order, and their numbers of elements
    spans : for each exposure, the number of its span (`solver.data.detector_spans`)
    """

    n_exp: int
    n_coef: int
    n_det: int
    optional: tuple[tuple[str, int], ...] = ()
    spans: tuple[int, ...] = ()

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """All groups except the sources, in table order."""
        return CALIBRATION_GROUPS + tuple(BY_NAME[name] for name, _ in self.optional)

    @cached_property
    def local_groups(self) -> tuple[Group, ...]:
        """Groups of which a measurement depends on one element each."""
        return local_groups(group.name for group in self.groups)

    def on(self, axis: Axis) -> tuple[Group, ...]:
        """Return the groups with one value per element of `axis`."""
        return tuple(group for group in self.groups if group.axis == axis)

    @cached_property
    def size(self) -> int:
        """Number of calibration parameters."""
        return self.first_motion + sum(self._length(group) for group in self.on("motion"))

    @cached_property
    def n_terms(self) -> int:
        """Number of terms of one direction: the distortion's and the optional ones."""
        return sum(self._length(group) for group in self._terms(0))

    @cached_property
    def n_walk(self) -> int:
        """Number of terms of one direction that walk from exposure to exposure.

        They are the first ones of the distortion.
        """
        return sum(self._length(group) for group in self.on("walk")[:1]) // self.n_exp

    @property
    def lengths(self) -> dict[str, int]:
        """Numbers of elements of the axes that are padded, but for the sources."""
        return {"exp": self.n_exp, "coef": self.n_coef, "walk": self.n_exp * self.n_walk}

    @property
    def walking(self) -> Int[np.ndarray, " two_walk"]:
        """Which of the terms of both directions walk, first those of x."""
        return np.r_[: self.n_walk, self.n_terms : self.n_terms + self.n_walk]

    @cached_property
    def per_exposure(self) -> int:
        """Number of parameters of one exposure."""
        return len(self.on("exp")) + 2 * self.n_walk

    @cached_property
    def first_coefficient(self) -> int:
        """Column of the first distortion coefficient."""
        return self.n_exp * self.per_exposure

    @cached_property
    def first_detector(self) -> int:
        """Column of the first detector parameter."""
        return self.first_coefficient + 2 * self.n_terms

    @cached_property
    def first_motion(self) -> int:
        """Column of the first parameter that moves from span to span."""
        return self.first_detector + self.n_det * len(self.on("det"))

    def coefficients(self) -> slice:
        """Return the columns of all terms, first those of one direction, then of the other."""
        return slice(self.first_coefficient, self.first_detector)

    def lower_terms(self, n_coef: int) -> Int[np.ndarray, " term"]:
        """Return which terms of one direction remain with the first `n_coef` of the distortion."""
        return np.r_[:n_coef, self.n_coef : self.n_terms]

    def element(
        self, axis: Axis, exposure: Int[np.ndarray, "*n"], detector: Int[np.ndarray, "*#n"]
    ) -> Int[np.ndarray, "*n"]:
        """Return the element of an axis of local groups that measurements depend on.

        Those of the first span, in which nothing moves, are given that of the second.
        """
        if axis == "exp":
            return exposure
        if axis == "det":
            return detector
        return motion_elements(np.asarray(self.spans, dtype=np.int64), exposure, detector)

    def touched(
        self, exposure: Int[np.ndarray, "*n"], detector: Int[np.ndarray, "*n"]
    ) -> Int[np.ndarray, "*n local"]:
        """Return the columns of `local_groups`, as the last axis, of exposures and detectors."""
        axes: set[Axis] = {group.axis for group in self.local_groups}
        element = {axis: self.element(axis, exposure, detector) for axis in axes}
        return np.stack(
            [self._columns[group.name][element[group.axis]] for group in self.local_groups], axis=-1
        )

    def walked(self, exposure: Int[np.ndarray, "*n"]) -> Int[np.ndarray, "*n two_walk"]:
        """Return the columns of the walking terms at exposures, first those of x."""
        first = self.per_exposure * exposure + len(self.on("exp"))
        return first[..., None] + np.arange(2 * self.n_walk)

    def columns(self, group: Group) -> np.ndarray:
        """Return the columns of one group, in the order of its axis."""
        return self._columns[group.name]

    @cached_property
    def _columns(self) -> dict[str, np.ndarray]:
        return {group.name: self._columns_of(group) for group in self.groups}

    def _columns_of(self, group: Group) -> np.ndarray:
        length = self._length(group)
        of_y = group.name.endswith("_y")
        if group.axis == "walk":
            own = self.walked(np.arange(self.n_exp))
            return own[:, of_y * self.n_walk :][:, : self.n_walk].ravel()
        if group.axis in TERM_AXES:
            before = self._terms(of_y)[: self._terms(of_y).index(group)]
            first = self.first_coefficient + of_y * self.n_terms
            return first + sum(map(self._length, before)) + np.arange(length)
        members = self.on(group.axis)
        first = {"exp": 0, "det": self.first_detector, "motion": self.first_motion}[group.axis]
        stride = self.per_exposure if group.axis == "exp" else len(members)
        return first + members.index(group) + stride * np.arange(length)

    def gather(self, values: dict[str, Shaped[np.ndarray, " _"]]) -> Shaped[np.ndarray, " calib"]:
        """Return the flat vector from values per group."""
        flat = np.empty(self.size)
        for group in self.groups:
            flat[self._columns[group.name]] = values[group.name]
        return flat

    def scatter(self, flat: Shaped[AnyArray, " calib"]) -> dict[str, Shaped[AnyArray, " _"]]:
        """Return the values per group from a flat NumPy or JAX vector."""
        return {name: flat[columns] for name, columns in self._columns.items()}

    def _length(self, group: Group) -> int:
        sizes = {"exp": self.n_exp, "coef": self.n_coef, "det": self.n_det}
        return dict(self.optional)[group.name] if group.setting else sizes[group.axis]

    def _terms(self, of_y: int) -> list[Group]:
        """Return the groups of the terms of one direction, in the order of their columns."""
        return [group for axis in TERM_AXES for group in self.on(axis)[of_y : of_y + 1]]
