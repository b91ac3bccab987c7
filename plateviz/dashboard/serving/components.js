// Components of a page: loaded by the browser itself, compiled once for all of a kind, laid out
// together, and never out of date.
//
// Panel loads components with a library for browsers that cannot load modules. It reads and writes
// anew 1.4 MB of them, which takes longer than to run them, and the browser keeps nothing of what it
// has compiled. Nothing here imports by a name that an import map would have to explain.
//
// Panel compiles the script of a component for each one of its kind that there is. Whenever a
// container gets a part, Panel lays out all that is in the container anew, and then all that is in
// the one around it, and each time the browser has to work out where everything is. Here containers
// wait for the next picture of the screen in which all their parts are drawn, and are laid out
// together: those that are in another one with it, except for cards, which have layouts of their
// own (see `own_layout.py`).
//
// A component of React is drawn first and follows its model, and the list of its parts, a moment
// later. What the server changed in between, Panel would not show until it changes again; here it is
// read again then.
//
// Columns of texts arrive packed.
//
// A table follows its model from when it is drawn.
//
// What the server has sent is not sent back to it.

// Milliseconds that a layout waits for components that are being drawn.
const LONGEST = 2000

window.importShim = address => import(address)
window.importShim.addImportMap = () => {}

document.addEventListener("DOMContentLoaded", () => {
  const models = Bokeh.Models.get("panel.models.esm.ReactiveESM").prototype
  const { compile } = models
  const compiled = new Map()
  models.compile = function () {
    // A bundle is compiled already.
    if (this.bundle != null) return compile.call(this)
    if (!compiled.has(this.esm)) compiled.set(this.esm, compile.call(this))
    return compiled.get(this.esm)
  }
  const { watch } = models
  models.watch = function (view, name, callback, isState) {
    watch.call(this, view, name, callback, isState)
    // The state of React does not change if the value is the same.
    if (isState) callback()
  }
  const container = Bokeh.Models.get("panel.models.esm.ReactComponent").prototype.default_view
  const { on_child_render } = container.prototype
  container.prototype.on_child_render = function (name, callback) {
    on_child_render.call(this, name, callback)
    // Without new parts, what follows the list of all parts reads it again, and the rest does nothing.
    callback([])
  }
  const views = Object.getPrototypeOf(container.prototype)
  const { compute_layout, invalidate_layout } = views
  // View -> whether its style sheets have to be written before.
  const waiting = new Map()
  const isCovered = (view, among) => {
    while (!view.has_own_layout && (view = view.parent) != null)
      if (among.has(view)) return true
    return false
  }
  // A component of React is drawn after its container, and its parts after it: whatever is laid out
  // before the last of them is laid out again.
  const isDrawn = view => {
    for (const part of view.child_views ?? [])
      if (!isDrawn(part)) return false
    return view._rendered !== false || !view.el.isConnected
  }
  let lastMoment = 0
  const layOut = () => {
    if (performance.now() < lastMoment && ![...Bokeh.index].every(isDrawn)) {
      requestAnimationFrame(layOut)
      return
    }
    const found = [...waiting.keys()].filter(view => !view.is_destroyed)
    const written = new Set(found.filter(view => waiting.get(view)))
    const laidOut = new Set(found)
    waiting.clear()
    // The browser works out the places once, after the last change of a style sheet. The part of a
    // container may be new although the container is not.
    for (const view of written) if (!isCovered(view, written)) view.write_layout()
    for (const view of laidOut) {
      if (isCovered(view, laidOut)) continue
      view.compute_layout_now()
      view.notify_finished()
    }
  }
  const wait = (view, isNew) => {
    if (waiting.size === 0) {
      lastMoment = performance.now() + LONGEST
      requestAnimationFrame(layOut)
    }
    waiting.set(view, isNew || waiting.get(view) === true)
  }
  views.write_layout = function () { this.update_layout() }
  views.compute_layout_now = function () { compute_layout.call(this) }
  views.compute_layout = function () {
    if (this.is_managed) compute_layout.call(this)
    else wait(this, false)
  }
  views.invalidate_layout = function () {
    if (this.is_managed) invalidate_layout.call(this)
    else wait(this, true)
  }

  // Columns of texts, see `packed_texts.py`.
  const { Deserializer } = Bokeh.require("core/serialization/deserializer")
  Deserializer.register("plateviz.texts", ({ texts, numbers }, deserializer) => {
    const words = texts.split("\n")
    return numbers === undefined
      ? words : Array.from(deserializer.decode(numbers), number => words[number])
  })

  // What the server has sent it knows. Bokeh sends it back as new with the first change that refers
  // to it, such as the styles that a table gets when it is drawn, and the server complains.
  const { decode } = Deserializer.prototype
  Deserializer.prototype.decode = function (value, buffers) {
    const { finalize, _decoding: isWithin } = this
    if (isWithin || finalize === undefined) return decode.call(this, value, buffers)
    this.finalize = model => {
      finalize(model)
      model.document?._new_models.delete(model)
    }
    try {
      return decode.call(this, value, buffers)
    } finally {
      this.finalize = finalize
    }
  }

  // After 0.3 s without a move, BokehJS takes a drag for a press, to which nothing here answers.
  // A hand may rest before it drags, and a busy browser may be late. This is the longest timeout.
  Bokeh.require("core/ui_gestures").UIGestures.press_threshold = 2 ** 31 - 1

  // A table that is not drawn yet takes what it shows when it is; Panel would change it before.
  const table = Bokeh.Models.get("panel.models.tabulator.DataTabulator").prototype.default_view
  const { connect_signals, render } = table.prototype
  table.prototype.connect_signals = function () {}
  table.prototype.render = function () {
    if (!this.is_following) {
      this.is_following = true
      connect_signals.call(this)
    }
    return render.call(this)
  }
})
