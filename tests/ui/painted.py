"""Whether many marks, which are painted as copies of their looks, are where each would be drawn."""

# Paint 600 marks of a figure at once and a hundred at a time, which are drawn one by one.
_BOTH = """() => {
  const glyphs = [];
  const walk = view => {
    if (view.model.type === "GlyphRenderer" && view.glyph.model.type === "Scatter")
      glyphs.push(view.glyph);
    [...(view.renderer_views?.values() ?? []), ...(view.child_views ?? [])].forEach(walk);
  };
  for (const view of Bokeh.index) walk(view);
  const [glyph] = glyphs.filter(one => one.data_size > 20 && one.sx[0] !== undefined);
  const indices = Array.from({ length: 600 }, (_, k) => k % glyph.data_size);
  // A mark without a size is not drawn; the browser has the sizes as they were sent.
  const { size } = glyph, sizes = Object.create(size);
  Object.assign(sizes, { is_Scalar: () => false, get: k => k % 7 ? size.get(k) : NaN });
  const opacities = count => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [900, 900];
    const context = canvas.getContext("2d");
    context.scale(1.5, 1.5);
    for (let k = 0; k < indices.length; k += count)
      glyph._paint(context, indices.slice(k, k + count), { size: sizes });
    return context.getImageData(0, 0, 900, 900).data.filter((_, at) => at % 4 === 3);
  };
  const [together, alone] = [opacities(600), opacities(100)];
  const sum = values => values.reduce((total, value) => total + value / 255, 0);
  const differences = together.map((opacity, at) => Math.abs(opacity - alone[at]));
  return [sum(together), sum(alone), sum(differences), differences.some(one => one > 0)];
}"""

# How often the page is laid out when it is asked for ten times: at once, while one of its parts is
# still being drawn, and after.
LAYOUTS_OF_TEN = """async () => {
  const [page] = Bokeh.index, [part] = page.child_views
  const now = page.compute_layout_now
  const pictures = async count => {
    while (count--) await new Promise(requestAnimationFrame)
    return times
  }
  let times = 0
  page.compute_layout_now = () => { times++; now.call(page) }
  part._rendered = false
  for (let i = 0; i < 10; i++) page.invalidate_layout()
  const found = [times, await pictures(4)]
  part._rendered = true
  found.push(await pictures(3))
  delete page.compute_layout_now
  return found
}"""


def require_marks_where_they_are(page):
    """Fail if marks that are painted together cover other pixels than each of them alone."""
    together, alone, differing, are_copied = page.evaluate(_BOTH)
    assert are_copied
    assert alone > 100
    assert abs(together - alone) < 0.02 * alone
    # Each copy is within an eighth of a pixel of its mark.
    assert differing < 0.1 * alone


def require_only_changes(page):
    """Fail if a style is written again as it was, or if a column is copied wrongly."""
    is_kept, css, whole, part = page.evaluate(
        """() => {
          const sheet = new (Bokeh.require("core/dom").InlineStyleSheet)("a { left: 0 }")
          const text = sheet.el.firstChild
          sheet.replace("a { left: 0 }")
          const isKept = sheet.el.firstChild === text
          sheet.replace("a { left: 1px }")
          const { BitSet } = Bokeh.require("core/util/bitset"), column = Float64Array.of(4, 5, 6)
          const whole = BitSet.all_set(3).select(column)
          column[0] = 7
          const part = BitSet.from_indices(3, [1]).select(column)
          return [isKept, sheet.css, [...whole], [...part]]
        }"""
    )
    assert is_kept
    assert css == "a { left: 1px }"
    assert (whole, part) == ([4, 5, 6], [5])
