// Selector -> attributes; null removes one.
const RULES = [
  [".MuiLinearProgress-root", { "aria-label": "Progress" }],
  ["[aria-label='Resize sidebar']", { role: "separator", "aria-orientation": "vertical" }],
  // The text of a tooltip, on an element of which nothing is known.
  ["span[aria-label]:not([role])", { role: "img" }],
  ["label.Mui-disabled", { "aria-disabled": "true" }],
  ["h3.title", { role: "heading", "aria-level": "1" }],
  ["h6.MuiTypography-subtitle1", { role: "heading", "aria-level": "2" }],
  // A table is a grid of row groups; Tabulator leaves a scroller and buttons among them.
  [".tabulator[role=grid]", { "aria-owns": null, "aria-label": "Table" }],
  [".tabulator-tableholder", { role: "rowgroup" }],
  [".tabulator-table", { role: "presentation" }],
  [".tabulator-footer", { role: "rowgroup" }],
  [".tabulator-footer-contents", { role: "row" }],
  [".tabulator-paginator", { role: "gridcell" }],
  [".tabulator-col-group, .tabulator-col.empty",
   { role: "presentation", "aria-sort": null, "aria-title": null }],
]

const put = (element, values) => {
  for (const [name, value] of Object.entries(values)) {
    if (value === null) element.removeAttribute(name)
    else if (element.getAttribute(name) !== value) element.setAttribute(name, value)
  }
}

// The fields of a slider: the label is that of the slider, and the arrows have none.
const nameFields = root => {
  const label = root.querySelector("label")?.textContent.trim() || "Value"
  const fields = [...root.querySelectorAll("input[type=text]:not([aria-label])")]
    .filter(field => !field.labels?.length && !field.hasAttribute("aria-labelledby"))
  fields.forEach((field, at) => put(field, { "aria-label": `${label} ${at ? "to" : "from"}` }))
  for (const box of root.querySelectorAll(".MuiInputAdornment-root")) {
    const arrows = [...box.querySelectorAll("button:not([aria-label])")]
    arrows.forEach((arrow, at) =>
      put(arrow, { "aria-label": `${at ? "Decrease" : "Increase"}: ${label}` }))
  }
}

const complete = root => {
  for (const [selector, values] of RULES)
    for (const element of root.querySelectorAll(selector)) put(element, values)
  // Places of titles that drawers do not have.
  for (const title of root.querySelectorAll("h5"))
    if (!title.textContent.trim()) put(title, { role: "presentation" })
  // Cards open by buttons that are all called the same.
  for (const header of root.querySelectorAll(".MuiCardHeader-root")) {
    const title = header.querySelector(".MuiCardHeader-content")?.textContent.trim()
    const opens = header.querySelector("button[aria-expanded]")
    if (title && opens) put(opens, { "aria-label": `show more: ${title}` })
  }
  nameFields(root)
}

export function render({ model }) {
  const observers = new Map()
  const waiting = new Set()
  const visit = root => {
    complete(root)
    if (!observers.has(root)) {
      const observer = new MutationObserver(() => schedule(root))
      observer.observe(root, { childList: true, subtree: true })
      observers.set(root, observer)
    }
    for (const element of root.querySelectorAll("*")) {
      // The shadows of figures have canvases only.
      const shadow = element.shadowRoot
      if (shadow && !observers.has(shadow) && !element.classList.contains("bk-GridBox"))
        visit(shadow)
    }
  }
  let timer = null
  const schedule = root => {
    waiting.add(root)
    timer ??= setTimeout(() => {
      timer = null
      const roots = [...waiting]
      waiting.clear()
      for (const [known, observer] of observers)
        if (known.host && !known.host.isConnected) {
          observer.disconnect()
          observers.delete(known)
        }
      roots.filter(root => root === document || root.host.isConnected).forEach(visit)
    }, 300)
  }
  visit(document)
  model.on("remove", () => {
    clearTimeout(timer)
    for (const observer of observers.values()) observer.disconnect()
  })
}
