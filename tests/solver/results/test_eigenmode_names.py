"""Names of eigenmodes, for hand-made vectors."""

import numpy as np
import pytest

from solver.data.parameters import BY_NAME, CALIBRATION_GROUPS
from solver.results.eigenmode_names import GroupShare, eigenmode_name, pattern

SIZES = {"exp": 12, "coef": 7, "det": 4}
RNG = np.random.default_rng(0)
PLACES = {
    "exp": RNG.uniform(-1.0, 1.0, (12, 2)),
    "det": np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]),
}
COMMON = {axis: np.ones(n) for axis, n in SIZES.items()}
GRADIENT = PLACES["exp"] @ (2.0, -1.0)
OPPOSED = np.array([1.0, -1.02, -0.99, 1.0])


def labels_of(group):
    if group.axis == "coef":
        return [
            f"{group.symbol[0]}({k})" for k in ("2,0", "1,1", "0,2", "3,0", "2,1", "1,2", "0,3")
        ]
    word = {"exp": "field 0 plate", "det": "detector"}[group.axis]
    return [f"{word} {i}" for i in range(SIZES[group.axis])]


def group_share(name, moves, share=1.0):
    group = BY_NAME[name]
    places = PLACES.get(group.axis)
    places = places.astype(float) if places is not None else None
    return GroupShare(group, share, np.asarray(moves, dtype=float), labels_of(group), places)


def name_of(**moves):
    """Return the name of an eigenmode, from the vector and share of each group."""
    shares = []
    for group in CALIBRATION_GROUPS:
        vector, share = moves.get(group.name, (np.zeros(SIZES[group.axis]), 0.0))
        shares.append(group_share(group.name, vector, share))
    return eigenmode_name(shares)


@pytest.mark.parametrize(
    ("group", "moves", "expected"),
    [
        ("detector_x", [1.0, 1.1, 0.9, 1.0], "common"),
        ("detector_x", [-1.0, -1.1, -0.9, -1.0], "common"),
        ("detector_x", OPPOSED, "opposed"),
        ("detector_x", [1.0, -1.0, 0.1, -0.1], "differences of"),
        ("detector_x", [0.01, -2.0, 0.1, -0.1], ""),
        ("pointing_ra", GRADIENT, "gradient of"),
        ("pointing_ra", GRADIENT + 0.3, "gradient of"),
        ("pointing_ra", np.cos(np.pi * np.arange(12)), "opposed"),
        ("pointing_ra", np.zeros(12), ""),
        ("distortion_x", np.ones(7), ""),
    ],
    ids=[
        "common",
        "common, backwards",
        "opposed",
        "differences",
        "one of four",
        "gradient",
        "gradient with an offset",
        "opposed exposures",
        "nothing",
        "terms",
    ],
)
def test_pattern(group, moves, expected):
    assert pattern(group_share(group, moves)) == expected


def test_single_group_is_named_alone():
    name = name_of(pointing_ra=(COMMON["exp"], 0.95), focal_length=(COMMON["exp"], 0.05))
    assert name == "common pointing RA"


def test_families_are_joined_by_with():
    name = name_of(
        detector_y=(COMMON["det"], 0.55),
        pointing_ra=(COMMON["exp"], 0.3),
        pointing_dec=(COMMON["exp"], 0.15),
    )
    assert name == "common detector y with common pointing RA, Dec"


def test_opposite_signs_in_a_family_are_joined_by_against():
    name = name_of(pitch_x=(COMMON["det"], 0.6), pitch_y=(-COMMON["det"], 0.4))
    assert name == "common pixel pitch x against y"


def test_largest_family_comes_first_with_groups_in_table_order():
    name = name_of(
        position_angle=(COMMON["exp"], 0.4),
        detector_x=(OPPOSED, 0.2),
        detector_y=(-OPPOSED, 0.3),
        detector_rotation=(COMMON["det"], 0.1),
    )
    assert name == ("opposed detector x, y with common position angle and detector rotation")


def test_gradients_of_a_family_are_named_together():
    name = name_of(
        position_angle=(COMMON["exp"], 0.7),
        pointing_ra=(GRADIENT, 0.15),
        pointing_dec=(-GRADIENT, 0.15),
    )
    assert name == "common position angle with gradients of pointing RA, Dec"


def test_distortion_terms_are_named():
    name = name_of(
        distortion_x=([1.0, 0.0, -1.0, 0.1, 0.0, 0.0, 0.0], 0.5),
        distortion_y=([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.3),
        focal_length=(GRADIENT, 0.2),
    )
    assert name == "distortion A(0,2), A(2,0), B(1,1) with gradient of focal length"


def test_dominant_exposure_is_named():
    moves = np.full(12, 0.01)
    moves[5] = 1.0
    assert name_of(focal_length=(moves, 1.0)) == "focal length of field 0 plate 5"


def test_small_share_of_a_family_is_omitted():
    name = name_of(pointing_ra=(COMMON["exp"], 0.96), pointing_dec=(GRADIENT, 0.04))
    assert name == "common pointing RA"


def test_groups_of_a_family_with_different_patterns_are_named_separately():
    name = name_of(pointing_ra=(COMMON["exp"], 0.6), pointing_dec=(GRADIENT, 0.4))
    assert name == "common pointing RA with gradient of pointing Dec"


def test_eigenmode_of_many_small_shares_is_named_after_the_largest_family():
    shares = {group.name: (COMMON[group.axis], 0.04) for group in CALIBRATION_GROUPS}
    shares["detector_x"] = (COMMON["det"], 0.045)
    assert "detector x" in name_of(**shares)


def test_sign_of_an_eigenmode_does_not_change_its_name():
    moves = {"detector_x": (OPPOSED, 0.5), "pointing_ra": (GRADIENT + 0.1, 0.5)}
    negated = {name: (-np.asarray(values), share) for name, (values, share) in moves.items()}
    assert name_of(**moves) == name_of(**negated)
