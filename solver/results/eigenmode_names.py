"""Names of modes: which groups of parameters take part, and how, in words for astronomers."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.data.parameters import CALIBRATION_GROUPS, Group

# A name tells of the families of groups with at least this share of the mode.
_TOLD = 0.09
# Of the mean square of the moves, what has to be that of their mean, or of a plane.
_COMMON, _PLANE = 0.8, 0.8
# How even the sizes of opposed moves are: squared mean size over mean square.
_EVEN = 0.8
# Of the sum of squares, what one element must have to stand for all, and each of a few.
_ONE, _FEW = 0.8, 0.2
# A plane fits fewer places than these whatever they do.
_LEAST_PLACES = 6
# The last word of a group that is one of a family: "x", "RA", "Dec", "A".
_LONGEST_LAST_WORD = 3

_NAMED = ""
_PLURAL = {"gradient of": "gradients of"}


class GroupShare(NamedTuple):
    """How one group takes part in a mode.

    `moves` are those of its elements, in one unit for all, `labels` their names, `places`
    their coordinates on the focal plane or the sky, where they have some.
    """

    group: Group
    share: float
    moves: Float[np.ndarray, " n"]
    labels: list[str]
    places: Float[np.ndarray, "n 2"] | None = None


def eigenmode_name(parts: list[GroupShare]) -> str:
    """Return a mode in words, the groups with the largest shares first.

    Groups that differ in their last word alone, as "detector x" and "detector y", are one
    family, which is left out if its share is small, and told together where they move alike
    (`pattern`). Two that are common with opposite signs are told "against" each other.

    Parameters
    ----------
    parts : all groups, their shares adding up to one
    """
    families: dict[str, list[GroupShare]] = {}
    for part in parts:
        families.setdefault(_family(part.group), []).append(part)
    shares = {name: sum(part.share for part in members) for name, members in families.items()}
    ranked = sorted(shares, key=lambda name: -shares[name])
    told = [name for name in ranked if shares[name] >= _TOLD] or ranked[:1]
    pieces = [piece for name in told for piece in _pieces(families[name])]
    first, *others = pieces
    return " with ".join([_phrase(first[0], [first[1]]), *_companions(others)])


def pattern(part: GroupShare) -> str:
    """Return in words how the elements of a group move.

    Returns
    -------
    "common", by much the same amount; "opposed", by much the same amount with both signs;
    "gradient of", linearly with their places; "differences of", in other ways; or "" where
    a few are to be named: one that outdoes all others, and the distortion's terms always
    """
    moves = part.moves
    count, total = len(moves), float(moves @ moves)
    if total <= 0.0 or part.group.axis == "coef":
        return _NAMED
    if count * float(moves.mean()) ** 2 >= _COMMON * total:
        return "common"
    if float(np.max(moves**2)) >= _ONE * total:
        return _NAMED
    if part.places is not None and _plane_share(moves, part.places) >= _PLANE:
        return "gradient of"
    if count * float(np.abs(moves).mean()) ** 2 >= _EVEN * total:
        return "opposed"
    return "differences of"


def _plane_share(moves: Float[np.ndarray, " n"], places: Float[np.ndarray, "n 2"]) -> float:
    """Return the share of the squares that a plane over the places explains."""
    if len(moves) < _LEAST_PLACES:
        return 0.0
    columns = np.column_stack([np.ones(len(moves)), places])
    rest = moves - columns @ np.linalg.lstsq(columns, moves)[0]
    return 1.0 - float(rest @ rest) / float(moves @ moves)


def _family(group: Group) -> str:
    stem, _, last = group.label.rpartition(" ")
    return stem if len(last) <= _LONGEST_LAST_WORD else group.label


def _pieces(members: list[GroupShare]) -> list[tuple[str, str]]:
    """Return (pattern, groups) for each way in which a family moves, the largest first."""
    share = sum(part.share for part in members)
    by_pattern: dict[str, list[GroupShare]] = {}
    for part in sorted(members, key=lambda part: -part.share):
        # What is small even in its family is not worth the words.
        if part.share >= _TOLD * share:
            by_pattern.setdefault(pattern(part), []).append(part)
    return [(words, _groups(words, alike)) for words, alike in by_pattern.items()]


def _groups(words: str, alike: list[GroupShare]) -> str:
    first, *others = sorted(alike, key=lambda part: CALIBRATION_GROUPS.index(part.group))
    if words == _NAMED:
        stem = _family(first.group) if first.group.axis == "coef" else ""
        return f"{stem} {', '.join(map(_elements, (first, *others)))}".strip()
    text = first.group.label
    for part in others:
        against = words == "common" and part.moves.sum() * first.moves.sum() < 0.0
        text += f"{' against' if against else ','} {part.group.label.rpartition(' ')[2]}"
    return text


def _elements(part: GroupShare) -> str:
    """Return the names of the elements that move most."""
    squares = part.moves**2
    largest = np.argsort(squares)[::-1]
    told = [i for i in largest if squares[i] >= _FEW * squares.sum()] or largest[:1]
    names = ", ".join(part.labels[i] for i in told)
    return names if part.group.axis == "coef" else f"{part.group.label} of {names}"


def _companions(pieces: list[tuple[str, str]]) -> list[str]:
    """Return what goes with the first phrase as one text, if anything does."""
    by_pattern: dict[str, list[str]] = {}
    for words, groups in pieces:
        by_pattern.setdefault(words, []).append(groups)
    phrases = [_phrase(words, groups) for words, groups in by_pattern.items()]
    return [_listed(phrases)] if phrases else []


def _phrase(words: str, groups: list[str]) -> str:
    several = len(groups) > 1 or "," in groups[0]
    return f"{_PLURAL.get(words, words) if several else words} {_listed(groups)}".strip()


def _listed(phrases: list[str]) -> str:
    *first, last = phrases
    return f"{', '.join(first)} and {last}" if first else last
