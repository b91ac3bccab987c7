// Components of a page: compiled once for all of a kind, and laid out together.
//
// Panel compiles the script of a component for each one of its kind that there is. Whenever a
// container gets a part, Panel lays out all that is in the container anew, and then all that is in
// the one around it, and each time the browser has to work out where everything is. Here containers
// wait for the next picture of the screen, and are laid out together: those that are in another one
// with it, except for cards, which have layouts of their own (see `own_layout.py`).

// The loader of components sends the event a second time.
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
  const container = Bokeh.Models.get("panel.models.esm.ReactComponent").prototype.default_view
  const views = Object.getPrototypeOf(container.prototype)
  const { compute_layout, invalidate_layout } = views
  // View -> whether its style sheets have to be written before.
  const waiting = new Map()
  const isCovered = view => {
    while (!view.has_own_layout && (view = view.parent) != null)
      if (waiting.has(view)) return true
    return false
  }
  const layOut = () => {
    const found = [...waiting].filter(([view]) => !view.is_destroyed && !isCovered(view))
    waiting.clear()
    // The browser works out the places once, after the last change of a style sheet.
    for (const [view, isNew] of found) if (isNew) view.write_layout()
    for (const [view] of found) {
      view.compute_layout_now()
      view.notify_finished()
    }
  }
  const wait = (view, isNew) => {
    if (waiting.size === 0) requestAnimationFrame(layOut)
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
}, { once: true })
