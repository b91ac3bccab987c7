// What keeps a page from being read or worked with by everybody, as texts; empty if there is nothing.
() => {
  const found = []
  const roots = []
  const gather = root => {
    roots.push(root)
    for (const one of root.querySelectorAll("*")) if (one.shadowRoot) gather(one.shadowRoot)
  }
  gather(document)
  const parentOf = one => one.assignedSlot ?? one.parentElement ?? one.getRootNode().host
  const isShown = one => one.checkVisibility({ opacityProperty: false, visibilityProperty: true })
    && one.getClientRects().length > 0
  const all = selector => roots.flatMap(root => [...root.querySelectorAll(selector)])
  const shown = selector => all(selector).filter(isShown)
  const say = (what, one) => found.push(`${what}: ${one.outerHTML.slice(0, 120)}`)

  const named = one => {
    const by = (one.getAttribute("aria-labelledby") ?? "").split(" ").filter(Boolean)
      .map(id => one.getRootNode().getElementById(id)?.textContent ?? "").join(" ")
    const texts = [one.getAttribute("aria-label"), by, one.title, one.alt, one.placeholder,
                   ...[...(one.labels ?? [])].map(label => label.textContent), one.textContent]
    return texts.some(text => text?.trim())
  }
  const controls = "button, a[href], input:not([type=hidden]), select, textarea, img, " +
    "[role=button], [role=tab], [role=menuitem], [role=switch], [role=slider], [role=combobox], " +
    "[role=progressbar], [role=dialog], [role=figure], [role=region], [role=grid]"
  for (const one of shown(controls))
    if (!one.closest("[aria-hidden=true]") && !named(one)) say("no name", one)

  const roles = new Set(("alert alertdialog application article banner button cell checkbox " +
    "columnheader combobox complementary contentinfo dialog document figure form grid gridcell " +
    "group heading img link list listbox listitem log main menu menubar menuitem " +
    "menuitemcheckbox menuitemradio navigation none note option presentation progressbar radio " +
    "radiogroup region row rowgroup rowheader scrollbar search searchbox separator slider " +
    "spinbutton status switch tab table tablist tabpanel textbox timer toolbar tooltip tree " +
    "treegrid treeitem").split(" "))
  for (const one of shown("[role]"))
    if (!roles.has(one.getAttribute("role"))) say("no such role", one)
  for (const one of shown("span[aria-label]:not([role]), div[aria-label]:not([role])"))
    if (!one.shadowRoot) say("a name without a role", one)
  for (const one of shown("[role=grid]"))
    for (const part of one.querySelectorAll("button, [tabindex]"))
      if (!part.closest("[role=gridcell], [role=columnheader], [role=rowgroup]"))
        say("not of a grid", part)

  const headings = shown("h1, h2, h3, h4, h5, h6, [role=heading]")
    .filter(one => one.getAttribute("role") !== "presentation")
  const levelOf = one => Number(one.getAttribute("aria-level") ?? one.tagName.slice(1))
  const first = headings.filter(one => levelOf(one) === 1)
  if (first.length !== 1) found.push(`${first.length} headings of the first level`)
  for (const one of headings) if (!one.textContent.trim()) say("an empty heading", one)
  if (shown("main, [role=main]").length !== 1) found.push("not one main part")
  if (!document.documentElement.lang) found.push("no language")
  for (const one of shown("[tabindex]")) if (one.tabIndex > 0) say("out of the order of focus", one)
  for (const root of roots) {
    const ids = [...root.querySelectorAll("[id]")].map(one => one.id)
    const twice = ids.filter((id, at) => ids.indexOf(id) !== at)
    if (twice.length) found.push(`the same id twice: ${twice[0]}`)
  }

  const probe = document.createElement("canvas").getContext("2d", { willReadFrequently: true })
  const rgba = text => {
    probe.clearRect(0, 0, 1, 1)
    probe.fillStyle = text
    probe.fillRect(0, 0, 1, 1)
    const [r, g, b, a] = probe.getImageData(0, 0, 1, 1).data
    return [r, g, b, a / 255]
  }
  const over = (top, below) => [0, 1, 2].map(i => top[i] * top[3] + below[i] * (1 - top[3]))
  const behind = one => {
    const layers = []
    for (let part = one; part; part = parentOf(part)) {
      const colour = rgba(getComputedStyle(part).backgroundColor)
      if (colour[3] > 0) layers.push(colour)
      if (colour[3] > 0.99) break
    }
    return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255])
  }
  const light = colour => colour.map(part => part / 255)
    .map(part => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4)
    .reduce((sum, part, at) => sum + part * [0.2126, 0.7152, 0.0722][at], 0)
  const isOut = one => {
    for (let part = one; part; part = parentOf(part)) {
      const style = getComputedStyle(part)
      if (style.opacity !== "1" || part.disabled || part.matches?.(".Mui-disabled, canvas") ||
          part.getAttribute?.("aria-disabled") === "true" ||
          part.getAttribute?.("aria-hidden") === "true") return true
    }
    return false
  }
  for (const one of shown("*")) {
    const hasText = [...one.childNodes].some(node => node.nodeType === 3 && node.textContent.trim())
    if (!hasText || ["STYLE", "SCRIPT", "OPTION"].includes(one.tagName) || isOut(one)) continue
    const style = getComputedStyle(one)
    const size = parseFloat(style.fontSize)
    const isLarge = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700)
    const back = behind(one)
    const [a, b] = [light(over(rgba(style.color), back)), light(back)].sort((x, y) => y - x)
    const ratio = (a + 0.05) / (b + 0.05)
    if (ratio < (isLarge ? 3 : 4.5)) say(`contrast ${ratio.toFixed(2)}`, one)
  }
  return [...new Set(found)]
}
