const made = (name, text = "", kind = "") => {
  const element = document.createElement(name)
  // As text: titles of figures have names of sources and runs.
  element.textContent = text
  if (kind) element.className = kind
  return element
}

const tableOf = ({ name, title, size, columns, rows }) => {
  const table = made("table")
  const shown = rows.length < size ? `, the first ${rows.length} of ${size} rows; Save has all` : ""
  table.append(made("caption", `${title ? `${title}: ` : ""}${name}${shown}`))
  const head = table.createTHead().insertRow()
  for (const column of columns) {
    const cell = made("th", column)
    cell.scope = "col"
    head.append(cell)
  }
  const body = table.createTBody()
  for (const row of rows) {
    const line = body.insertRow()
    for (const text of row) line.append(made("td", text))
  }
  return table
}

export function render({ model, el }) {
  const host = el.getRootNode().host
  let card = host
  while (card && !card.classList?.contains("card"))
    card = card.parentElement ?? card.getRootNode().host
  const button = (label, text) => {
    const one = made("button", text)
    one.type = "button"
    one.title = label
    one.setAttribute("aria-label", `${label}: ${model.title}`)
    return one
  }
  const explain = button("What this shows", "?")
  const enlarge = button("Open large", "\u2922")

  const words = made("div", "", "words")
  words.hidden = true
  words.tabIndex = 0
  words.setAttribute("role", "region")
  words.setAttribute("aria-label", `Explanation: ${model.title}`)
  words.append(made("p", model.help))
  if (model.equation) words.append(made("p", model.equation, "equation"))
  const summary = made("p")
  const list = made("button", "Show the numbers as a table")
  list.type = "button"
  const tables = made("div")
  words.append(summary, list, tables)
  words.append(made("p", `In the documents: ${model.place}`, "muted"))

  explain.setAttribute("aria-expanded", "false")
  const show = isShown => {
    words.hidden = !isShown
    explain.setAttribute("aria-expanded", String(isShown))
    if (isShown) words.style.setProperty("--room", `${Math.max(card.clientHeight - 12, 160)}px`)
    else tables.replaceChildren()
  }
  list.onclick = () => model.send_msg("tables")
  model.on("msg:custom", answer => {
    const found = answer.tables.map(tableOf)
    tables.replaceChildren(...(found.length ? found : [made("p", "Nothing is drawn yet.")]))
  })
  const describe = () => {
    summary.textContent = model.summary ? `Now: ${model.summary}` : ""
    card.setAttribute("aria-label", [model.title, model.summary].filter(Boolean).join(". "))
    // Numbers of what was drawn before would be wrong.
    tables.replaceChildren()
  }
  card.setAttribute("role", "figure")
  describe()
  model.on("summary", describe)

  let before = null
  const isLarge = () => before !== null
  const fill = () => {
    before = card.getAttribute("style")
    Object.assign(card.style, { position: "fixed", inset: "8px", zIndex: 2000,
                                width: "auto", height: "auto", margin: "0" })
    enlarge.textContent = "\u00d7"
    enlarge.title = "Close"
  }
  const close = () => {
    card.setAttribute("style", before ?? "")
    before = null
    enlarge.textContent = "\u2922"
    enlarge.title = "Open large"
  }
  explain.onclick = () => show(words.hidden)
  enlarge.onclick = () => {
    isLarge() ? close() : fill()
    place()
  }
  const escape = event => {
    if (event.key !== "Escape") return
    if (!words.hidden) {
      show(false)
      explain.focus()
    } else if (isLarge()) close()
  }
  document.addEventListener("keydown", escape)
  model.on("remove", () => document.removeEventListener("keydown", escape))
  const corner = made("div")
  const colour = () => { corner.className = `corner ${model.theme}` }
  colour()
  model.on("theme", colour)
  // Where a figure is drawn anew at once, a word would only flicker.
  const stale = made("p", "Being computed", "stale")
  stale.title = "The last solution; another is being computed"
  stale.setAttribute("role", "status")
  // In the lower corner, where figures have the fewest words.
  const place = () => stale.style.setProperty("--bottom", `${card.clientHeight - 29}px`)
  const follow = () => {
    place()
    stale.hidden = !model.is_stale
  }
  follow()
  model.on("is_stale", follow)
  corner.append(words, stale, explain, enlarge)
  el.append(corner)
}
