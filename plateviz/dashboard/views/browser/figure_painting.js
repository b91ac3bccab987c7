// Fewer marks are drawn one by one, and so are those of more looks, or of larger ones.
const LEAST = 500, MOST_LOOKS = 32, LARGEST = 100
// Places within a pixel of the screen, along each axis, at which a mark has a stamp.
const PLACES = 4
// What the look of a mark depends on.
const PARTS = ["marker", "size", "angle", "fill_color", "fill_alpha", "line_color", "line_alpha",
               "line_width", "line_join", "line_cap", "line_dash", "line_dash_offset"]
// Look -> its stamps, of all figures; the one not used for longest is first.
const MOST_STAMPS = 200
const kept = new Map()

// Number of the look of each mark, and a mark of each look; null if they are too many.
const looksOf = (all, indices) => {
  const varied = PARTS.map(name => all[name]).filter(one => !one.is_Scalar())
  const looks = [], rows = [], numbers = new Uint8Array(indices.length)
  const is = (look, row) => {
    for (let at = 0; at < varied.length; at++)
      if (!Object.is(look[at], varied[at].get(row))) return false
    return true
  }
  for (let k = 0, number = 0; k < indices.length; k++) {
    const row = indices[k]
    if (rows.length === 0 || !is(looks[number], row))
      number = looks.findIndex(look => is(look, row))
    if (number < 0) {
      if (looks.length === MOST_LOOKS) return null
      number = looks.push(varied.map(one => one.get(row))) - 1
      rows.push(row)
    }
    numbers[k] = number
  }
  return { numbers, rows }
}

// Pixels of the screen from the middle of a mark of a row to its farthest corner along an axis.
// A mark without a size is not drawn.
const reachOf = (all, row, scale) =>
  Math.ceil(scale * (0.6 * (all.size.get(row) || 0) + 1.1 * all.line_width.get(row))) + 1

// The pixels that a mark covers, at each place: where, and premultiplied red, green, blue, opacity.
const stampsOf = (view, paintEach, data, row, scale, reach) => {
  const side = 2 * reach, count = PLACES * PLACES
  const sheet = new OffscreenCanvas(side, side * count)
  const context = sheet.getContext("2d", { willReadFrequently: true })
  for (let place = 0; place < count; place++) {
    const x = reach + place % PLACES / PLACES
    const y = reach + Math.floor(place / PLACES) / PLACES
    context.setTransform(scale, 0, 0, scale, x, side * place + y)
    paintEach.call(view, context, [row], { ...data, sx: { [row]: 0 }, sy: { [row]: 0 } })
  }
  const colours = context.getImageData(0, 0, side, side * count).data
  return Array.from({ length: count }, (_, place) => {
    const covered = []
    for (let y = 0; y < side; y++)
      for (let x = 0; x < side; x++) {
        const [red, green, blue, opacity] = colours.subarray(4 * (x + side * (y + side * place)))
        const share = opacity / 255
        if (opacity > 0)
          covered.push(x - reach, y - reach, red * share, green * share, blue * share, opacity)
      }
    return Float32Array.from(covered)
  })
}

const keptStampsOf = (view, paintEach, data, all, row, scale) => {
  const key = [scale, ...PARTS.map(name => all[name].get(row))].join()
  const stamps = kept.get(key)
    ?? stampsOf(view, paintEach, data, row, scale, reachOf(all, row, scale))
  kept.delete(key)
  kept.set(key, stamps)
  if (kept.size > MOST_STAMPS) kept.delete(kept.keys().next().value)
  return stamps
}

// Put a stamp over premultiplied pixels of a picture.
const put = (pixels, width, height, stamp, left, top) => {
  for (let k = 0; k < stamp.length; k += 6) {
    const x = left + stamp[k], y = top + stamp[k + 1]
    if (x < 0 || y < 0 || x >= width || y >= height) continue
    const at = 4 * (x + width * y), below = 1 - stamp[k + 5] / 255
    pixels[at] = stamp[k + 2] + below * pixels[at]
    pixels[at + 1] = stamp[k + 3] + below * pixels[at + 1]
    pixels[at + 2] = stamp[k + 4] + below * pixels[at + 2]
    pixels[at + 3] = stamp[k + 5] + below * pixels[at + 3]
  }
}

// Draw all marks as one picture, in which each mark is a stamp of its look.
const paintStamped = (view, paintEach, context, indices, data) => {
  const { a: scale, b, c, d, e: left, f: top } = context.getTransform()
  const all = { ...view, ...data }
  if (b !== 0 || c !== 0 || scale !== d || view.visuals.hatch.doit || view.model.defs.size)
    return false
  const looks = looksOf(all, indices)
  if (looks === null || looks.rows.some(row => !(reachOf(all, row, scale) <= LARGEST)))
    return false
  const stamps = looks.rows.map(row =>
    keptStampsOf(view, paintEach, data, all, row, scale))
  const { width, height } = context.canvas, { sx, sy } = all
  const picture = new OffscreenCanvas(width, height).getContext("2d")
  const image = picture.createImageData(width, height), pixels = image.data
  for (let k = 0; k < indices.length; k++) {
    const x = Math.round(PLACES * (scale * sx[indices[k]] + left))
    const y = Math.round(PLACES * (scale * sy[indices[k]] + top))
    if (!isFinite(x + y)) continue
    const column = Math.floor(x / PLACES), line = Math.floor(y / PLACES)
    const place = x - PLACES * column + PLACES * (y - PLACES * line)
    put(pixels, width, height, stamps[looks.numbers[k]][place], column, line)
  }
  for (let at = 0; at < pixels.length; at += 4) {
    const opacity = pixels[at + 3]
    if (opacity === 0 || opacity === 255) continue
    for (let colour = at; colour < at + 3; colour++) pixels[colour] *= 255 / opacity
  }
  picture.putImageData(image, 0, 0)
  context.save()
  context.setTransform(1, 0, 0, 1, 0, 0)
  context.drawImage(picture.canvas, 0, 0)
  context.restore()
  return true
}

// Lay out the plots of a figure once for all changes that arrive together.
const layOutOnce = plot => {
  const layOut = plot.invalidate_layout, waiting = new Set()
  plot.invalidate_layout = function () {
    const figure = this.parent ?? this
    if (waiting.has(figure)) return
    waiting.add(figure)
    queueMicrotask(() => {
      waiting.delete(figure)
      if (this.el.isConnected) layOut.call(this)
    })
  }
}

// Tell of a zoom with the wheel at once, and not after the next picture of what is drawn by now.
const tellOfZoom = plot => {
  const update = plot.update_range
  plot.update_range = function (range, options) {
    update.call(this, range, options)
    if (options?.scrolling) this.trigger_ranges_update_event()
  }
}

// Copy a column of which all rows are drawn as a whole, and not row by row.
const copyWhole = rows => {
  const select = rows.select
  rows.select = function (column) {
    const isWhole = this.count === column.length
    return isWhole ? column.slice() : select.call(this, column)
  }
}

// Leave a sheet of styles as it is that would be written with the same text: each picture of a figure
// writes where its parts are, and the browser would look for their styles and lay out anew.
const writeChanges = sheet => {
  const update = sheet._update
  sheet._update = function (text) {
    if (this.css !== text) update.call(this, text)
  }
}

export function render() {
  const view = Bokeh.Models.get("Scatter").prototype.default_view.prototype
  // The page has one BokehJS, also where several dashboards are parts of it.
  if (view.isStamped) return
  view.isStamped = true
  const paintEach = view._paint
  view._paint = function (context, indices, data) {
    const isDone = indices.length >= LEAST && context instanceof CanvasRenderingContext2D
      && paintStamped(this, paintEach, context, indices, data)
    if (!isDone) paintEach.call(this, context, indices, data)
  }
  // No style sheet has a colour of a figure, and its words have sizes of their own.
  Bokeh.require("core/visuals/visual").VisualProperties.prototype._get_css_value = () => ""
  const plot = Bokeh.Models.get("Plot").prototype.default_view.prototype
  Object.defineProperty(plot, "base_font_size", { get: () => 13 })
  layOutOnce(plot)
  tellOfZoom(plot)
  writeChanges(Bokeh.require("core/dom").InlineStyleSheet.prototype)
  copyWhole(Bokeh.require("core/util/bitset").BitSet.prototype)
}
