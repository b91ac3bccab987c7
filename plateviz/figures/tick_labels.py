"""Which ticks have a label, where not all labels have room."""

from bokeh import models

from plateviz.figures.figure import Axis

# Screen pixels between labels.
_GAP = 5
# Every label, or every second one, and so on. To leave out one where it overlaps another would
# leave uneven numbers, as those with a sign and a comma are longer.
_KEEP_EVERY_NTH = """
    const shown = [...indices]
    const fit = (some) => some.every((k, n) => n == 0 || distance(some[n - 1], k) >= gap)
    for (let step = 1; step <= shown.length; step++) {
      for (let first = 0; first < step; first++) {
        const some = shown.filter((_, n) => n % step == first)
        if (fit(some)) return some
      }
    }
    return shown.slice(0, 1)
"""


def follow_policy(drawn: models.Axis, axis: Axis) -> None:
    """Let a drawn axis leave out labels that have no room, evenly where its ticks are even."""
    # Turned labels lie beside each other, although the rectangles around them overlap.
    if axis.rotation:
        policy = models.AllLabels
    elif axis.is_log or axis.ticks is not None:
        policy = models.NoOverlap
    else:
        policy = models.CustomLabelingPolicy
    if isinstance(drawn.major_label_policy, policy):
        return
    is_even = policy is models.CustomLabelingPolicy
    drawn.update(
        major_label_policy=policy(code=_KEEP_EVERY_NTH, args={"gap": _GAP}) if is_even else policy()
    )
