"use strict";
// Draws the figures of a report in the reader's theme, and exports their values.
(() => {
  const { colours, palettes } = JSON.parse(document.getElementById("colours").textContent);
  const figures = [...document.querySelectorAll("figure")];
  const button = document.getElementById("theme");
  const shown = new Map();
  let theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";

  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return JSON.parse(await new Response(stream).text());
  }

  // The documents are in the colours of the light theme.
  function darkened(part) {
    if (typeof part === "string") return colours[part] ?? part;
    if (Array.isArray(part)) {
      const found = palettes.find(([light]) =>
        part.length === light.length && light.every((colour, i) => colour === part[i]));
      return found ? found[1] : part.map(darkened);
    }
    if (part === null || typeof part !== "object") return part;
    return Object.fromEntries(Object.entries(part).map(([key, value]) => [key, darkened(value)]));
  }

  async function draw(figure) {
    const choice = figure.querySelector("select")?.value ?? 0;
    const wanted = `${choice} ${theme}`;
    if (shown.get(figure)?.wanted === wanted) return;
    const packed = figure.querySelectorAll("script.document")[choice].textContent;
    shown.set(figure, { wanted });
    const light = await unpacked(packed);
    const doc = theme === "dark" ? darkened(light) : light;
    const plot = figure.querySelector(".plot");
    plot.style.minHeight = `${plot.offsetHeight}px`;
    plot.replaceChildren();
    plot.id = `plot-${figure.id}`;
    const views = await Bokeh.embed.embed_item({
      target_id: plot.id,
      root_id: doc.roots[0].id,
      doc,
      version: doc.version,
    });
    plot.style.minHeight = "";
    shown.set(figure, { wanted, views });
    figure.dataset.drawn = wanted;
  }

  async function drawAll() {
    for (const figure of figures) {
      await draw(figure);
      await new Promise((done) => setTimeout(done, 0));
    }
    document.body.dataset.drawn = theme;
  }

  function paint() {
    document.documentElement.dataset.theme = theme;
    button.textContent = theme === "dark" ? "Light" : "Dark";
    return drawAll();
  }

  function quoted(value) {
    const text = String(value ?? "");
    return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  }

  // All data sources of a figure as CSV blocks, each with its column names.
  function valuesOf(figure) {
    const { views } = shown.get(figure);
    const doc = views.roots[0].model.document;
    const blocks = [...doc._all_models.values()]
      .filter((model) => model.type === "ColumnDataSource")
      .map((source) => {
        const names = source.columns();
        const columns = names.map((name) => [...source.get_array(name)]);
        const rows = (columns[0] ?? []).map((_, i) =>
          columns.map((column) => quoted(column[i]?.length && typeof column[i] !== "string"
            ? [...column[i]].join(" ") : column[i])).join(","));
        return [names.map(quoted).join(","), ...rows].join("\n");
      });
    return blocks.join("\n\n") + "\n";
  }

  function save(figure) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([valuesOf(figure)], { type: "text/csv" }));
    link.download = `${figure.id.replace("figure-", "")}.csv`;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  function sort(heading) {
    const body = heading.closest("table").tBodies[0];
    const column = heading.cellIndex;
    const ascending = heading.getAttribute("aria-sort") !== "ascending";
    const words = (row) => row.cells[column].textContent.replaceAll(",", "");
    const compare = (a, b) => {
      const [first, second] = [words(a), words(b)];
      const difference = Number(first) - Number(second);
      return Number.isNaN(difference) ? first.localeCompare(second) : difference;
    };
    const rows = [...body.rows].sort((a, b) => (ascending ? compare(a, b) : compare(b, a)));
    heading.parentElement.querySelectorAll("th").forEach((th) => th.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", ascending ? "ascending" : "descending");
    body.append(...rows);
  }

  document.querySelectorAll("th").forEach((th) => th.addEventListener("click", () => sort(th)));
  for (const figure of figures) {
    figure.querySelector("select")?.addEventListener("change", () => draw(figure));
    figure.querySelector("button.values").addEventListener("click", () => save(figure));
  }
  button.addEventListener("click", () => {
    theme = theme === "dark" ? "light" : "dark";
    paint();
  });
  // Open all tables for printing.
  addEventListener("beforeprint", () => {
    document.querySelectorAll("details").forEach((part) => { part.open = true; });
  });
  paint();
})();
