"""What the arrows of a drawing are made of."""


def shafts_of(overlay):
    """Return the shafts of its arrows: before the two strokes of each head."""
    strokes = next(e for e in overlay if e.label == "arrows").dframe()
    return strokes[: len(strokes) // 3]
