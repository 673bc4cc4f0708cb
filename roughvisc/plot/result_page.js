// Page of results: the choices of the reader, and what is drawn for them. Bokeh draws; the fields are unpacked here.
"use strict";
(async () => {
  const { cases, items, palettes, levels, steps } = JSON.parse(document.getElementById("data").textContent);
  const element = (id) => document.getElementById(id);
  const plots = {};
  for (const [name, item] of Object.entries(items)) {
    await Bokeh.embed.embed_item(item, name);
    plots[name] = Bokeh.documents.at(-1).get_model_by_name(name);
  }
  const model = (name) => Bokeh.documents.map((one) => one.get_model_by_name(name)).find((one) => one != null);
  const [image, outline, cut, cutContact, line, dots] = ["image", "outline", "cut", "cut_contact", "line", "dots"].map(model);
  const [alongCut, now] = ["along_cut", "now"].map(model);
  const colours = model("colours");
  const chosen = { case: 0, field: "", row: cases[0].start, cut: "x", scale: "case", curve: "", x: null, y: null, held: false };
  const short = (value) => (Number.isFinite(value) ? String(+value.toPrecision(4)) : "none");

  // ---- fields: levels of the frames, as differences from frame to frame
  async function unpack(field) {
    if (!field.codes) {
      const bytes = Uint8Array.from(atob(field.data), (letter) => letter.charCodeAt(0));
      const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
      const codes = new Uint16Array(await new Response(stream).arrayBuffer());
      for (let i = field.size; i < codes.length; i++) codes[i] += codes[i - field.size];
      field.codes = codes;
      field.data = null;
    }
    return field;
  }
  const frame = (field, row) => field.codes.subarray(row * field.size, (row + 1) * field.size);
  function valueOf(field, code) {
    if (code > levels) return NaN;
    if (field.decades) return code ? field.most * 10 ** (field.decades * (code / levels - 1)) : 0;
    return field.least + (code / levels) * (field.most - field.least);
  }
  // With tension, cells in contact may have a pressure below zero: then only the gap shows the contact.
  const contactField = ({ fields: { pressure, gap } }) => (pressure?.isSigned ? gap : pressure ?? gap);
  function contactOf(one, row) { // which cells are in contact: with pressure, else without a gap
    const field = contactField(one);
    if (!field) return null;
    const isPressure = field === one.fields.pressure;
    return frame(field, row).map((code) => +(code <= levels && (isPressure ? code > 0 : code === 0)));
  }

  // ---- the choices
  const selects = {};
  function addSelect(name, title, options, value) {
    const label = document.createElement("label"), select = document.createElement("select");
    label.append(title, select);
    for (const [key, text] of options) select.add(new Option(text, key));
    select.id = name;
    select.value = value;
    select.addEventListener("change", () => choose(name, select.value));
    element("controls").append(label);
    selects[name] = select;
  }
  function setOptions(select, options, value) {
    select.replaceChildren(...options.map(([key, text]) => new Option(text, key)));
    select.value = value;
  }
  const varied = Object.keys(cases[0].varied);
  const isTold = new Set(cases.map((one) => JSON.stringify(one.varied))).size === cases.length;
  if (cases.length > 1 && isTold) {
    for (const name of varied) {
      const texts = [...new Set(cases.map((one) => one.varied[name]))];
      addSelect("varied " + name, name, texts.map((text) => [text, text]), cases[0].varied[name]);
    }
  } else if (cases.length > 1) addSelect("case", "Case", cases.map((one, i) => [i, one.name]), 0);
  addSelect("field", "Field", [], "");
  const scales = [["row", "this " + steps.axis], ["case", "all " + steps.rows]];
  if (cases.length > 1) scales.push(["all", "all cases"]);
  addSelect("scale", "Colour scale", scales, "case");
  addSelect("cut", "Profile along", [["x", "x"], ["y", "y"]], "x");
  addSelect("curve", "History", [], "");

  function choose(name, value) {
    if (name.startsWith("varied ")) { // the case with this value that shares most others
      const key = name.slice(7), before = cases[chosen.case].varied;
      const likeness = (one) => (one.varied[key] === value ? varied.filter((other) => one.varied[other] === before[other]).length : -1);
      chosen.case = cases.reduce((best, one, i) => (likeness(one) > likeness(cases[best]) ? i : best), cases.findIndex((one) => one.varied[key] === value));
    } else chosen[name] = name === "case" ? +value : value;
    show();
  }

  // ---- drawing
  let drawnCase = -1, drawing = Promise.resolve();
  const show = () => (drawing = drawing.then(draw).catch((error) => console.error(error)));

  async function draw() {
    const one = cases[chosen.case], names = Object.keys(one.fields), last = one.places.length - 1;
    if (drawnCase !== chosen.case) {
      if (!(chosen.field in one.fields)) chosen.field = names[0] ?? "";
      if (!(chosen.curve in one.curves)) chosen.curve = Object.keys(one.curves)[0] ?? "";
      setOptions(selects.field, names.map((name) => [name, one.fields[name].label]), chosen.field);
      setOptions(selects.curve, Object.entries(one.curves).map(([name, curve]) => [name, curve.name]), chosen.curve);
      for (const name of varied) if (selects["varied " + name]) selects["varied " + name].value = one.varied[name];
      if (selects.case) selects.case.value = chosen.case;
    }
    chosen.row = Math.max(0, Math.min(chosen.row, last));
    element("row").max = last;
    element("row").value = chosen.row;
    element("row").setAttribute("aria-valuetext", one.places[chosen.row]);
    element("place").textContent = one.places[chosen.row];
    element("facts").replaceChildren(...Object.entries(one.facts).map(([name, texts]) => {
      const whole = document.createElement("span"), label = document.createElement("span");
      label.textContent = name + " ";
      whole.append(label, texts[chosen.row]);
      return whole;
    }));
    drawCurve(one);
    for (const id of ["key", "map", "reading", "profile"]) element(id).hidden = !names.length;
    if (names.length) {
      const field = await unpack(one.fields[chosen.field]);
      await unpack(contactField(one) ?? field);
      fit(one, drawnCase >= 0 && same(cases[drawnCase], one));
      drawMap(one, field);
      drawCut();
    }
    drawnCase = chosen.case;
  }

  const same = (one, other) => ["left", "bottom", "width", "height", "unit"].every((name) => one.plane[name] === other.plane[name]);
  function fit(one, keepsZoom) { // the whole surface, unless the reader has zoomed into the same one
    const { left, bottom, width, height, unit } = one.plane;
    if (keepsZoom) return;
    plots.map.x_range.setv({ start: left, end: left + width, reset_start: left, reset_end: left + width });
    plots.map.y_range.setv({ start: bottom, end: bottom + height, reset_start: bottom, reset_end: bottom + height });
    plots.map.below[0].axis_label = `x [${unit}]`;
    plots.map.left[0].axis_label = `y [${unit}]`;
    chosen.x = left + width / 2;
    chosen.y = bottom + height / 2;
    if (one.crest) [chosen.x, chosen.y] = one.crest;
    resize();
  }

  function endsOf(one, field) { // of the colours, as values
    if (chosen.scale === "all") {
      const all = cases.map((other) => other.fields[chosen.field]).filter((other) => other);
      const low = field.under && !field.decades ? 0 : Math.min(...all.map((other) => other.low));
      return [low, Math.max(...all.map((other) => other.high))];
    }
    if (chosen.scale === "case") return [field.low, field.high];
    const known = Array.from(frame(field, chosen.row)).filter((code) => code <= levels && (!field.under || code > 0));
    if (!known.length) return [field.low, field.high];
    const high = valueOf(field, known.reduce((a, b) => Math.max(a, b)));
    const low = field.decades ? high * 1e-3 : field.under ? 0 : valueOf(field, known.reduce((a, b) => Math.min(a, b)));
    if (field.isSigned) return [Math.min(low, -1e-3 * high), Math.max(high, -1e-3 * low)];
    return [low, high];
  }

  function drawMap(one, field) {
    const { nx, ny, left, bottom, width, height } = one.plane;
    const [low, high] = endsOf(one, field), codes = frame(field, chosen.row);
    const shades = new Float32Array(levels + 2); // level -> place on the colours, below them -1
    for (let code = 0; code <= levels; code++) {
      const value = valueOf(field, code);
      const place = field.isSigned ? 0.5 + (0.5 * value) / (value < 0 ? -low : high) : field.decades ? Math.log(value / low) / Math.log(high / low) : high > low ? (value - low) / (high - low) : 0.5;
      shades[code] = (field.under && code === 0) || place < 0 ? (field.under ? -1 : 0) : Math.min(place, 1);
    }
    shades[levels + 1] = NaN;
    const Array2 = image.data.image[0].constructor;
    image.data = { image: [new Array2(Float32Array.from(codes, (code) => shades[code]), [ny, nx])], x: [left], y: [bottom], dw: [width], dh: [height] };
    colours.setv({ palette: palettes[field.palette], low_color: field.under?.colour ?? palettes[field.palette][0], nan_color: field.absent.colour });
    const mask = contactOf(one, chosen.row);
    outline.data = mask ? border(mask, one.plane) : { x: [], y: [] };
    drawKey(field, low, high, codes);
  }

  function border({ length: size, ...mask }, { nx, ny, left, bottom, width, height }) { // of the contact, along the sides of cells
    const x = [], y = [], dx = width / nx, dy = height / ny;
    for (let j = 1; j < ny; j++) {
      for (let i = 0, from = -1; i <= nx; i++) {
        const isEdge = i < nx && mask[j * nx + i] !== mask[(j - 1) * nx + i];
        if (isEdge && from < 0) from = i;
        if (!isEdge && from >= 0) {
          x.push(left + from * dx, left + i * dx, NaN);
          y.push(bottom + j * dy, bottom + j * dy, NaN);
          from = -1;
        }
      }
    }
    for (let i = 1; i < nx; i++) {
      for (let j = 0, from = -1; j <= ny; j++) {
        const isEdge = j < ny && mask[j * nx + i] !== mask[j * nx + i - 1];
        if (isEdge && from < 0) from = j;
        if (!isEdge && from >= 0) {
          x.push(left + i * dx, left + i * dx, NaN);
          y.push(bottom + from * dy, bottom + j * dy, NaN);
          from = -1;
        }
      }
    }
    return { x, y };
  }

  function drawKey(field, low, high, codes) {
    const bar = document.createElement("canvas"), palette = palettes[field.palette], pen = bar.getContext("2d");
    bar.width = palette.length;
    bar.height = 1;
    palette.forEach((colour, i) => { pen.fillStyle = colour; pen.fillRect(i, 0, 1, 1); });
    const text = (words) => Object.assign(document.createElement("span"), { textContent: words });
    const swatch = ({ word, colour }) => {
      const patch = Object.assign(text(word), { className: "swatch" });
      patch.style.setProperty("--colour", colour);
      return patch;
    };
    const isAbove = codes.some((code) => code <= levels && valueOf(field, code) > high * (1 + 1e-6));
    const parts = [text(`${field.label}${field.unit ? ` [${field.unit}]` : ""}:`), text(short(low)), bar, text((isAbove ? "≥ " : "") + short(high) + (field.decades ? ", logarithmic" : ""))];
    if (field.under && codes.includes(0)) parts.push(swatch(field.under));
    if (codes.includes(levels + 1)) parts.push(swatch(field.absent));
    element("key").replaceChildren(...parts);
  }

  function drawCut() {
    const one = cases[chosen.case], field = one.fields[chosen.field];
    if (!field?.codes || chosen.x === null) return;
    const { nx, ny, left, bottom, width, height, unit } = one.plane;
    const i = Math.max(0, Math.min(nx - 1, Math.floor(((chosen.x - left) / width) * nx)));
    const j = Math.max(0, Math.min(ny - 1, Math.floor(((chosen.y - bottom) / height) * ny)));
    const codes = frame(field, chosen.row), mask = contactOf(one, chosen.row), alongX = chosen.cut === "x";
    const cells = Array.from({ length: alongX ? nx : ny }, (_, k) => (alongX ? j * nx + k : k * nx + i));
    const places = cells.map((_, k) => (alongX ? left + ((k + 0.5) * width) / nx : bottom + ((k + 0.5) * height) / ny));
    const values = cells.map((cell) => valueOf(field, codes[cell]));
    cut.data = { x: places, y: values };
    cutContact.data = { x: places, y: values.map((value, k) => (mask?.[cells[k]] ? value : NaN)) };
    alongCut.data = alongX ? { x: [left, left + width], y: [chosen.y, chosen.y] } : { x: [chosen.x, chosen.x], y: [bottom, bottom + height] };
    plots.profile.below[0].axis_label = `${chosen.cut} [${unit}]`;
    plots.profile.left[0].axis_label = `${field.label}${field.unit ? ` [${field.unit}]` : ""}`;
    const [from, size] = alongX ? [left, width] : [bottom, height];
    plots.profile.x_range.setv({ start: from, end: from + size });
    let [low, high] = chosen.scale === "row" ? endsOf(one, field) : [field.under ? 0 : field.least, field.most];
    if (!(high > low)) [low, high] = [low - 1, low + 1];
    plots.profile.y_range.setv({ start: low - 0.04 * (high - low), end: high + 0.04 * (high - low) });
    const code = codes[j * nx + i], value = valueOf(field, code);
    const text = Number.isNaN(value) ? field.absent.word : `${field.label.toLowerCase()} ${short(value)} ${field.unit}`.trim();
    const state = mask?.[j * nx + i] && field.absent.word !== "contact" ? ", in contact" : "";
    element("reading").textContent = `x = ${short(chosen.x)} ${unit}, y = ${short(chosen.y)} ${unit}: ${text}${state}${chosen.held ? " (held; click to follow the cursor)" : ""}`;
  }

  function drawCurve(one) {
    const curve = one.curves[chosen.curve];
    line.data = curve ? { x: curve.x, y: curve.y } : { x: [], y: [] };
    dots.data = curve ? { x: one.across.rows, y: curve.kept } : { x: [], y: [] };
    plots.history.below[0].axis_label = one.across.label;
    plots.history.left[0].axis_label = curve?.label ?? "";
    now.location = one.across.rows[chosen.row];
  }

  // ---- size and colours
  function resize() {
    const { width, height } = cases[chosen.case].plane ?? { width: 1, height: 1 }, whole = element("map").clientWidth;
    const side = Math.max(120, whole - 75), up = Math.max(120, Math.min(Math.max(window.innerHeight - 310, 320), 900));
    const scale = Math.min(side / width, up / height);
    plots.map.setv({ frame_width: Math.max(60, Math.round(width * scale)), frame_height: Math.max(60, Math.round(height * scale)) });
    for (const name of ["profile", "history"]) plots[name].setv({ frame_width: Math.max(120, element(name).clientWidth - 90), frame_height: 210 });
  }
  const isDark = matchMedia("(prefers-color-scheme: dark)");
  function paint() {
    const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name).trim();
    for (const plot of Object.values(plots)) {
      plot.setv({ background_fill_color: colour("--paper"), border_fill_color: colour("--paper"), outline_line_color: colour("--line") });
      for (const axis of [...plot.below, ...plot.left]) axis.setv({ axis_label_text_color: colour("--ink"), major_label_text_color: colour("--ink"), axis_line_color: colour("--soft"), major_tick_line_color: colour("--soft"), minor_tick_line_color: colour("--soft") });
      for (const grid of plot.center) if ("grid_line_color" in grid) grid.grid_line_color = plot === plots.map ? null : colour("--line");
    }
    for (const name of ["cut_look", "line_look"]) model(name).line_color = colour("--blue");
    model("dots_look").setv({ fill_color: colour("--blue"), line_color: colour("--blue") });
  }
  isDark.addEventListener("change", paint);
  let width = 0;
  new ResizeObserver(() => { if (width !== document.body.clientWidth) { width = document.body.clientWidth; resize(); } }).observe(document.body);
  if (matchMedia("(pointer: coarse)").matches) for (const plot of Object.values(plots)) for (const tool of plot.toolbar.tools) tool.active = false; // a finger scrolls the page

  // ---- the reader's hands
  addEventListener("place", ({ detail: { plot, kind, x, y } }) => {
    const one = cases[chosen.case];
    if (plot === "history") {
      const distance = (row) => Math.abs(one.across.isLog ? Math.log(row / x) : row - x);
      chosen.row = one.across.rows.reduce((best, row, i, rows) => (distance(row) < distance(rows[best]) ? i : best), 0);
      return show();
    }
    if (kind === "tap") chosen.held = !chosen.held;
    if (kind === "tap" || !chosen.held) [chosen.x, chosen.y] = [x, y];
    drawCut();
  });
  element("row").addEventListener("input", () => { chosen.row = +element("row").value; show(); });
  let playing = null;
  function play() {
    if (playing !== null) clearInterval(playing);
    playing = playing !== null ? null : setInterval(() => { chosen.row = (chosen.row + 1) % cases[chosen.case].places.length; show(); }, 300);
    element("play").textContent = playing !== null ? "❚❚" : "▶";
    element("play").setAttribute("aria-label", playing !== null ? "pause" : "play");
  }
  element("play").addEventListener("click", play);
  addEventListener("keydown", (event) => {
    if (event.target.matches?.("select, input, button") || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (step) { chosen.row += step; show(); } else if (event.key === " ") play(); else return;
    event.preventDefault();
  });
  paint();
  resize();
  await show();
  document.body.dataset.ready = "true";
})();
