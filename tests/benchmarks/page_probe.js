// Functions of a page of the dashboard: what its figures show, and when that is complete.
window.plateviz = (() => {
  // Every message of the server: when it came, how long it is, how many changes it has.
  const messages = [];
  const Socket = window.WebSocket;
  window.WebSocket = class extends Socket {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", ({ data }) => {
        const events = typeof data === "string" && data.startsWith('{"events"')
          ? JSON.parse(data).events.length : 0;
        messages.push({ at: now(), bytes: data.byteLength ?? data.length, events });
      });
    }
  };
  // Milliseconds since 1970, as the server counts them.
  const now = () => performance.timeOrigin + performance.now();
  const views = () => {
    const found = [];
    const walk = view => { found.push(view); (view.child_views ?? []).forEach(walk); };
    for (const view of Bokeh.index) walk(view);
    return found;
  };
  const card = view => {
    for (let e = view.el; e; e = e.parentElement ?? e.getRootNode().host)
      for (const name of e.classList ?? []) if (name.startsWith("figure-")) return name.slice(7);
  };
  const isInView = element => {
    const box = element.getBoundingClientRect();
    return box.width > 0 && box.bottom > 0 && box.top < innerHeight;
  };
  const isOnScreen = ({ el }) => isInView(el) && el.checkVisibility({ visibilityProperty: true });
  // To look for the plots lays the page out, which would delay it in every picture.
  let known = [], looked = -Infinity;
  const plots = () => {
    if (performance.now() - looked > 200) {
      known = views().filter(view => view.model.type === "Plot" && isOnScreen(view))
        .map(view => Object.assign(view, { card: card(view) }));
      looked = performance.now();
    }
    return known;
  };
  const column = (source, name) => source.data[name] ?? source.data.get?.(name);
  // Sum of some of the values: to sum all of them in every picture would take its time.
  const total = values => {
    let sum = 0;
    const step = 1 + (values.length >> 6);
    for (let i = 0; i < values.length; i += step) {
      const value = values[i];
      if (typeof value === "number" && isFinite(value)) sum += (1 + i % 7) * value;
      else if (ArrayBuffer.isView(value) || Array.isArray(value)) sum += total(value);
    }
    return sum;
  };
  // What the figures on the screen show, as a text that differs for other solutions.
  const shown = () => plots().map(view => [view.card, ...view.model.renderers.map(renderer => {
    const data = renderer.data_source?.data ?? {};
    const columns = data instanceof Map ? [...data.values()] : Object.values(data);
    return columns.map(values => `${values.length} ${total(values)}`).join();
  })].join(";"));
  // The tables of sources on the screen.
  const ofSources = () => plots().flatMap(view => view.model.renderers
    .map(renderer => renderer.data_source).filter(source => column(source, "id")));
  const chosen = source => {
    const ids = column(source, "id");
    return new Set(source.selected.indices.map(row => ids[row]));
  };
  // Whether every figure on the screen shows as selected what this table has selected.
  const agree = among => {
    const wanted = chosen(among);
    return wanted.size > 0 && ofSources().every(source => {
      const rows = new Set(source.selected.indices);
      return Array.from(column(source, "id")).every((id, row) => wanted.has(id) === rows.has(row));
    });
  };
  // Corners, in pixels of the window, of a box with some `count` points of a figure about one.
  const boxAround = (name, count, row) => {
    const view = plots().find(one => one.card === name);
    const { data_source: source, glyph } = view.model.renderers
      .find(one => one.glyph.type === "Scatter" && column(one.data_source, "id"));
    const [x, y] = [glyph.x, glyph.y].map(of => Array.from(column(source, of.field)));
    const canvas = view.canvas_view.el.getBoundingClientRect(), { bbox } = view.frame;
    // A drag that begins outside of the frame selects nothing.
    const isInside = ({ x, y }) => x > canvas.left + bbox.left && x < canvas.left + bbox.right
      && y > canvas.top + bbox.top && y < canvas.top + bbox.bottom;
    const boxAt = at => {
      const far = x.map((_, i) => Math.max(Math.abs(x[i] - x[at]), Math.abs(y[i] - y[at])));
      const half = [...far].sort((a, b) => a - b)[Math.min(count, far.length) - 1];
      return [-1, 1].map(sign => ({
        x: canvas.left + view.frame.x_scale.compute(x[at] + sign * half),
        y: canvas.top + view.frame.y_scale.compute(y[at] - sign * half),
      }));
    };
    window.plateviz.among = source;
    for (let k = 0; k < x.length; k++) {
      const box = boxAt((row + k) % x.length);
      if (box.every(isInside)) return box;
    }
    throw new Error(`${name}: no box of ${count} marks is inside the frame`);
  };
  // The elements that match, inside of components too.
  const elements = (selector, within = document) => {
    const found = [];
    const walk = root => {
      for (const e of root.querySelectorAll("*")) {
        if (e.matches(selector)) found.push(e);
        if (e.shadowRoot) walk(e.shadowRoot);
      }
    };
    walk(within);
    if (within.shadowRoot) walk(within.shadowRoot);
    return found;
  };
  const texts = () => elements(".solution, .strip").map(e => e.textContent).join();
  // Whether all that is in view is drawn and judged in a theme: no card is empty or faded, each plot
  // has the background, and the server has sent nothing for a while.
  const isWhole = (background, quietMs) => {
    const isQuiet = messages.length > 0 && now() - messages.at(-1).at > quietMs;
    if (!window.Bokeh?.index || !isQuiet || document.fonts.status !== "loaded") return false;
    const cards = elements(".figure, .tabulator").filter(e => e.checkVisibility());
    const isFaded = e => e.checkVisibility() && isInView(e) && getComputedStyle(e).opacity < 1;
    const isEmpty = e => isInView(e) && !e.matches(".tabulator")
      && !elements("canvas, .empty, .tabulator, input", e).length;
    const isWaiting = e => isInView(e) && e.textContent.includes("Being drawn.");
    // A page may have nothing to draw, and say why.
    const hasAny = cards.length > 0 || elements(".empty").some(isInView);
    return hasAny && !cards.some(isEmpty)
      && !elements(".fading").some(isFaded) && !elements(".empty").some(isWaiting)
      && !elements(".judging").some(e => e.checkVisibility())
      && plots().every(view => view.model.background_fill_color === background);
  };
  // When a person last did something.
  let acted = 0;
  for (const kind of ["keydown", "pointerup", "wheel"])
    addEventListener(kind, event => { acted = performance.timeOrigin + event.timeStamp; }, true);
  // Resolve with the times of what a person did and of the picture after `isDone`.
  const until = isDone => new Promise(resolve => {
    const look = () => isDone()
      ? requestAnimationFrame(() => setTimeout(() => resolve([acted, now()])))
      : requestAnimationFrame(look);
    look();
  });
  return { agree, boxAround, isWhole, messages, plots, shown, texts, until };
})();
