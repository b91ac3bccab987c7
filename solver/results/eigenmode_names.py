"""Names of eigenmodes: which parameter groups contribute, and in which pattern."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.data.parameters import PARAMETERS, Group

# Minimum share of the eigenmode for a family of groups to be named.
_MIN_SHARE = 0.09
# Minimum fraction of the moves' mean square due to their mean, or to a plane.
_MIN_COMMON, _MIN_PLANE = 0.8, 0.8
# Minimum evenness of the sizes of opposed moves: squared mean size over mean square.
_MIN_EVENNESS = 0.8
# Minimum fraction of the sum of squares of an element named alone, and of each of several.
_MIN_SINGLE, _MIN_AMONG_SEVERAL = 0.8, 0.2
# Minimum number of places; a plane fits fewer too easily.
_MIN_PLACES = 6
# Maximum length of the last word of a group in a family: "x", "RA", "Dec", "A".
_MAX_LAST_WORD = 3

# Pattern of groups of which single elements are named.
_NAMED = ""
_PLURAL = {"gradient of": "gradients of"}


class GroupShare(NamedTuple):
    """Contribution of one group to an eigenmode.

    `moves` are the components of its elements, all in the same unit, `labels` their names, and
    `places` their coordinates on the focal plane or the sky, if they have any.
    """

    group: Group
    share: float
    moves: Float[np.ndarray, " n"]
    labels: list[str]
    places: Float[np.ndarray, "n 2"] | None = None


def eigenmode_name(groups: list[GroupShare]) -> str:
    """Return the name of an eigenmode, with the groups of the largest shares first.

    Groups that differ only in their last word, such as "detector x" and "detector y", form a
    family. Families with small shares are omitted, and groups of a family with the same
    `pattern` are named together. Common moves of opposite signs are joined by "against".

    Parameters
    ----------
    groups : contributions of all groups, with shares that sum to one
    """
    families: dict[str, list[GroupShare]] = {}
    for member in groups:
        families.setdefault(_family(member.group), []).append(member)
    shares = {name: sum(member.share for member in members) for name, members in families.items()}
    ranked = sorted(shares, key=lambda name: -shares[name])
    named = [name for name in ranked if shares[name] >= _MIN_SHARE] or ranked[:1]
    pieces = [piece for name in named for piece in _family_pieces(families[name])]
    first, *others = pieces
    return " with ".join([_phrase(first[0], [first[1]]), *_companions(others)])


def pattern(member: GroupShare) -> str:
    """Return how the elements of a group move, as words.

    Returns
    -------
    "common", by nearly the same amount; "opposed", by nearly the same amount with both signs;
    "gradient of", linearly with their places; "differences of", in other ways; or "" if single
    elements are to be named: a dominant one, and distortion terms always
    """
    moves = member.moves
    count, total = len(moves), float(moves @ moves)
    if total <= 0.0 or member.group.is_term:
        return _NAMED
    if count * float(moves.mean()) ** 2 >= _MIN_COMMON * total:
        return "common"
    if float(np.max(moves**2)) >= _MIN_SINGLE * total:
        return _NAMED
    if member.places is not None and _plane_share(moves, member.places) >= _MIN_PLANE:
        return "gradient of"
    if count * float(np.abs(moves).mean()) ** 2 >= _MIN_EVENNESS * total:
        return "opposed"
    return "differences of"


def _plane_share(moves: Float[np.ndarray, " n"], places: Float[np.ndarray, "n 2"]) -> float:
    """Return the fraction of the sum of squares that a plane over the places explains."""
    if len(moves) < _MIN_PLACES:
        return 0.0
    columns = np.column_stack([np.ones(len(moves)), places])
    residual = moves - columns @ np.linalg.lstsq(columns, moves)[0]
    return 1.0 - float(residual @ residual) / float(moves @ moves)


def _family(group: Group) -> str:
    stem, _, last = group.label.rpartition(" ")
    return stem if len(last) <= _MAX_LAST_WORD else group.label


def _family_pieces(members: list[GroupShare]) -> list[tuple[str, str]]:
    """Return (pattern, groups) for each pattern of a family, the largest share first."""
    share = sum(member.share for member in members)
    by_pattern: dict[str, list[GroupShare]] = {}
    for member in sorted(members, key=lambda member: -member.share):
        # Groups with a small share of their family are omitted.
        if member.share >= _MIN_SHARE * share:
            by_pattern.setdefault(pattern(member), []).append(member)
    return [(kind, _groups(kind, same_kind)) for kind, same_kind in by_pattern.items()]


def _groups(kind: str, same_kind: list[GroupShare]) -> str:
    first, *others = sorted(same_kind, key=lambda member: PARAMETERS.index(member.group))
    if kind == _NAMED:
        stem = _family(first.group) if first.group.is_term else ""
        return f"{stem} {', '.join(map(_elements, (first, *others)))}".strip()
    text = first.group.label
    for member in others:
        against = kind == "common" and member.moves.sum() * first.moves.sum() < 0.0
        text += f"{' against' if against else ','} {member.group.label.rpartition(' ')[2]}"
    return text


def _elements(member: GroupShare) -> str:
    """Return the names of the elements that move most."""
    squares = member.moves**2
    largest = np.argsort(squares)[::-1]
    named = [i for i in largest if squares[i] >= _MIN_AMONG_SEVERAL * squares.sum()] or largest[:1]
    names = ", ".join(member.labels[i] for i in named)
    return names if member.group.is_term else f"{member.group.label} of {names}"


def _companions(pieces: list[tuple[str, str]]) -> list[str]:
    """Return the pieces after the first one as one phrase, or none."""
    by_pattern: dict[str, list[str]] = {}
    for kind, groups in pieces:
        by_pattern.setdefault(kind, []).append(groups)
    phrases = [_phrase(kind, groups) for kind, groups in by_pattern.items()]
    return [_listed(phrases)] if phrases else []


def _phrase(kind: str, groups: list[str]) -> str:
    several = len(groups) > 1 or "," in groups[0]
    return f"{_PLURAL.get(kind, kind) if several else kind} {_listed(groups)}".strip()


def _listed(phrases: list[str]) -> str:
    *first, last = phrases
    return f"{', '.join(first)} and {last}" if first else last
