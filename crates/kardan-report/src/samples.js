"use strict";
(() => {
  const place = document.getElementById("samples-plots");
  const data = JSON.parse(document.getElementById("samples-data").textContent);
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const figure = (value) => {
    if (!Number.isFinite(value)) return "no number";
    const size = Math.abs(value);
    const text = size !== 0 && (size >= 1e6 || size < 1e-4) ? value.toExponential(4) : String(parseFloat(value.toPrecision(5)));
    return text.replace(/-/g, "−");
  };
  const bytes = (text) => Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
  const count = data.count;
  const sample = new Uint32Array(bytes(data.sample).buffer);
  const ended = bytes(data.ended);
  const variant = data.variant ? new Uint32Array(bytes(data.variant).buffer) : new Uint32Array(count);
  const columns = data.columns.map((column) => {
    const values = new Float32Array(bytes(column.data).buffer);
    let [low, high] = [Infinity, -Infinity];
    for (const value of values) {
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    const some = low <= high;
    // Equal values are drawn in the middle.
    const room = high > low ? 0 : (Math.abs(column.from) || 1) * 0.05;
    const [from, span] = some ? [low - room, high - low + 2 * room] : [0, 1];
    const places = values.map((value) => (Number.isFinite(value) ? (value - from) / span : NaN));
    const title = column.unit ? `${column.name} [${column.unit}]` : column.name;
    const gaps = places.some((place) => place !== place);
    return { ...column, values, places, title, some, gaps, least: column.from + from, span };
  });
  const NONE = 2;
  const passed = data.requirements.map((one) => bytes(one.passed));
  // Whether a requirement belongs to a variant.
  const applies = passed.map((own) => {
    const found = data.variants.map(() => false);
    for (let k = 0; k < count; k++) if (own[k] !== NONE) found[variant[k]] = true;
    return found;
  });
  // Any part of the runs drawn so far is representative.
  const step = (() => {
    const common = (a, b) => (b ? common(b, a % b) : a);
    let step = Math.max(1, Math.round(count * 0.618));
    while (common(count, step) > 1) step++;
    return step;
  })();
  const order = new Uint32Array(count);
  for (let k = 0, at = 0; k < count; k++, at = (at + step) % count) order[k] = at;

  const make = (tag, parent, text, properties) => {
    const made = Object.assign(document.createElement(tag), properties);
    if (text) made.textContent = text;
    parent.append(made);
    return made;
  };
  const choice = (parent, label, names, chosen) => {
    const box = make("label", parent, label + " ");
    const select = make("select", box);
    names.forEach((name, k) => make("option", select, name, { value: k, selected: k === chosen }));
    select.addEventListener("change", changed);
    return select;
  };
  const titles = columns.map((one) => one.title);
  const parameters = columns.flatMap((one, k) => (one.kind === "parameter" ? [k] : []));
  const numbers = columns.flatMap((one, k) => (one.kind === "parameter" ? [] : [k]));
  const tools = make("div", place, "", { className: "choices" });
  const across = choice(tools, "across", titles, data.across);
  const up = choice(tools, "up", titles, data.up);
  const colour = choice(tools, "colour by", ["any failure", ...data.requirements.map((one) => one.text)], 1 + data.requirements.findIndex((one) => one.column === data.up));
  const only = data.variants.length > 1 ? choice(tools, "variant", ["all", ...data.variants], 0) : null;
  const frame = (label) => {
    const box = make("div", place, "", { className: "plot" });
    const canvas = make("canvas", make("div", box));
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", label);
    return { box, canvas, context: canvas.getContext("2d"), layer: document.createElement("canvas") };
  };
  const key = make("p", place, "", { className: "hint" });
  const scatter = frame("Runs as points; the tables list their numbers.");
  const tip = make("div", scatter.box, "", { className: "tip", hidden: true });
  const pinned = make("p", place, "", { className: "pinned", hidden: true });
  const line = make("div", place, "", { className: "choices" });
  const measure = numbers.length > 0 ? choice(line, "last axis", numbers.map((k) => titles[k]), Math.max(0, numbers.indexOf(data.up))) : null;
  const clear = make("button", line, "all runs", { type: "button", title: "clear the selection on axes" });
  const told = make("span", line, "", { className: "hint" });
  told.setAttribute("role", "status");
  const parallel = frame("Runs as lines over their parameters.");
  make("p", place, "Drag along an axis to select runs, click it to clear; both plots follow. Click a point for the command of its full run.", { className: "hint how" });

  let brushes = new Map();
  let axes = [];
  let [fate, chosen, shown] = [new Uint8Array(count), new Uint8Array(count), 0];
  let [width, ratio, missing, failing, picked] = [0, 1, 0, 0, -1];
  const HEIGHT = 380, LEFT = 74, RIGHT = 16, TOP = 12, BELOW = 46, LANE = 26, ROOM = 72;
  const paper = window.matchMedia("print");

  function judge() {
    const which = Number(colour.value) - 1;
    for (let k = 0; k < count; k++) {
      if (which >= 0) fate[k] = passed[which][k];
      else fate[k] = ended[k] && passed.every((one) => one[k] !== 0) ? 1 : 0;
    }
  }
  function choose() {
    const own = only ? Number(only.value) - 1 : -1;
    const bounds = [...brushes].map(([column, range]) => [columns[column].places, ...range]);
    const [xs, ys] = [columns[across.value].places, columns[up.value].places];
    shown = missing = failing = 0;
    for (let k = 0; k < count; k++) {
      let inside = own < 0 || variant[k] === own;
      for (let b = 0; inside && b < bounds.length; b++) {
        const [places, low, high] = bounds[b];
        const at = places[k];
        // A range that ends below the axis includes runs without a number.
        inside = at === at ? at >= low && at <= high : low < 0;
      }
      chosen[k] = inside ? 1 : 0;
      if (!inside) continue;
      shown++;
      failing += fate[k] === 0;
      missing += xs[k] !== xs[k] || ys[k] !== ys[k];
    }
    told.textContent = `${shown} of ${count} runs are selected, ${failing} of them fail` + (Number(colour.value) ? " it." : ".");
    place.dataset.chosen = shown;
    clear.disabled = brushes.size === 0;
  }

  const rgb = (text) => {
    const digits = text.slice(1);
    return digits.length === 3 ? [...digits].map((one) => parseInt(one + one, 16)) : [0, 2, 4].map((k) => parseInt(digits.slice(k, k + 2), 16));
  };
  function size(plot, wide) {
    const pixels = [wide, HEIGHT].map((size) => Math.round(size * ratio));
    plot.wide = wide;
    plot.canvas.parentElement.style.width = wide > width ? wide + "px" : "";
    [plot.canvas.width, plot.canvas.height] = pixels;
    plot.canvas.style.height = HEIGHT + "px";
    // Many marks are counted in larger pixels: each frame processes all of them.
    plot.scale = count > 20000 && !paper.matches ? 1 : ratio;
    [plot.layer.width, plot.layer.height] = [wide, HEIGHT].map((size) => Math.round(size * plot.scale));
    const all = plot.layer.width * plot.layer.height;
    plot.counts = [0, 1, 2].map(() => new Uint32Array(all));
    plot.behind = new Uint32Array(all);
    plot.image = new ImageData(plot.layer.width, plot.layer.height);
  }
  const reset = (plot) => { plot.counts.forEach((one) => one.fill(0)); plot.behind.fill(0); };

  // Counts of marks per pixel as colours: failing runs are on top.
  function paint(plot, alphas) {
    const out = new Uint32Array(plot.image.data.buffer);
    out.fill(0);
    const [fail, hold, none, grey] = [style("--curve-1"), style("--curve-0"), style("--curve-6"), style("--line")].map(rgb);
    const [failing, holding, others] = plot.counts;
    const [over, solid] = alphas.map((alpha) => Float32Array.from({ length: 4096 }, (_, n) => 1 - (1 - alpha) ** n));
    const behind = plot.behind;
    for (let k = 0; k < out.length; k++) {
      const a = failing[k], b = holding[k], c = others[k], d = behind[k];
      if ((a | b | c | d) === 0) continue;
      const pa = over[a < 4096 ? a : 4095];
      const pb = (1 - pa) * solid[b < 4096 ? b : 4095];
      const pc = (1 - pa - pb) * solid[c < 4096 ? c : 4095];
      const pd = d === 0 ? 0 : (1 - pa - pb - pc) * 0.5;
      const whole = pa + pb + pc + pd;
      const red = (pa * fail[0] + pb * hold[0] + pc * none[0] + pd * grey[0]) / whole;
      const green = (pa * fail[1] + pb * hold[1] + pc * none[1] + pd * grey[1]) / whole;
      const blue = (pa * fail[2] + pb * hold[2] + pc * none[2] + pd * grey[2]) / whole;
      out[k] = ((255 * whole + 0.5) << 24) | ((blue + 0.5) << 16) | ((green + 0.5) << 8) | (red + 0.5);
    }
    plot.layer.getContext("2d").putImageData(plot.image, 0, 0);
  }
  function begin(plot) {
    const { context } = plot;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, plot.canvas.width, plot.canvas.height);
    context.drawImage(plot.layer, 0, 0, plot.canvas.width, plot.canvas.height);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = "12px " + getComputedStyle(document.body).fontFamily;
    context.fillStyle = context.strokeStyle = style("--ink");
    context.lineWidth = 1;
    return context;
  }
  // Round numbers within an axis, by their positions.
  function ticks(column) {
    if (!column.some) return [];
    const raw = column.span / 5;
    const power = 10 ** Math.floor(Math.log10(raw));
    const distance = [1, 2, 5, 10].map((k) => k * power).find((one) => one >= raw * 0.999);
    const out = [];
    for (let k = Math.ceil(column.least / distance); k * distance <= column.least + column.span && out.length < 12; k++) {
      out.push([(k * distance - column.least) / column.span, figure(Math.abs(k * distance) < 1e-9 * column.span ? 0 : k * distance)]);
    }
    return out;
  }
  const cut = (context, text, room) => {
    if (context.measureText(text).width <= room) return text;
    let short = text;
    while (short.length > 1 && context.measureText(short + "…").width > room) short = short.slice(0, -1);
    return short + "…";
  };
  const stroke = (context, colour, ...points) => {
    context.strokeStyle = colour;
    context.beginPath();
    points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
  };

  const inner = () => [width - LEFT - RIGHT, HEIGHT - TOP - BELOW];
  let grid = null;
  // A run as a square, as a function that draws one and returns its position.
  function points() {
    const [w, h] = inner();
    const [xs, ys] = [columns[across.value].places, columns[up.value].places];
    const { counts, scale, layer: { width: pixels } } = scatter;
    const half = Math.round((shown <= 2000 ? 2 : shown <= 20000 ? 1 : 0.5) * scale);
    return (k) => {
      if (!chosen[k] || xs[k] !== xs[k] || ys[k] !== ys[k]) return;
      const own = counts[fate[k] === 0 ? 0 : fate[k] === NONE ? 2 : 1];
      const column = Math.round((LEFT + xs[k] * w) * scale), row = Math.round((TOP + (1 - ys[k]) * h) * scale);
      for (let r = -half; r <= half; r++) {
        const first = (row + r) * pixels + column;
        for (let c = -half; c <= half; c++) own[first + c]++;
      }
    };
  }
  function drawScatter() {
    const [w, h] = inner();
    const [x, y] = [columns[across.value], columns[up.value]];
    const [xs, ys] = [x.places, y.places];
    const context = begin(scatter);
    const [line, faint, ink] = [style("--grid"), style("--faint"), style("--ink")];
    context.globalCompositeOperation = "destination-over";
    for (const [at] of ticks(x)) stroke(context, line, [LEFT + at * w, TOP], [LEFT + at * w, TOP + h]);
    for (const [at] of ticks(y)) stroke(context, line, [LEFT, TOP + (1 - at) * h], [LEFT + w, TOP + (1 - at) * h]);
    context.globalCompositeOperation = "source-over";
    context.textAlign = "center";
    for (const [at, text] of ticks(x)) context.fillText(text, LEFT + at * w, TOP + h + 22);
    context.textAlign = "right";
    for (const [at, text] of ticks(y)) context.fillText(text, LEFT - 12, TOP + (1 - at) * h + 4);
    // Points at the ends keep a distance from the axes.
    stroke(context, faint, [LEFT - 6, TOP - 6], [LEFT - 6, TOP + h + 6], [LEFT + w + 6, TOP + h + 6]);
    context.textAlign = "center";
    context.fillText(cut(context, x.title, w), LEFT + w / 2, HEIGHT - 8);
    context.save();
    context.translate(14, TOP + h / 2);
    context.rotate(-Math.PI / 2);
    context.fillText(cut(context, y.title, h), 0, 0);
    context.restore();
    context.setLineDash([6, 4]);
    context.lineWidth = 1.5;
    for (const [column, bound] of bounds()) {
      const at = (bound - columns[column].least) / columns[column].span;
      if (at < 0 || at > 1) continue;
      if (x === columns[column]) stroke(context, ink, [LEFT + at * w, TOP], [LEFT + at * w, TOP + h]);
      if (y === columns[column]) stroke(context, ink, [LEFT, TOP + (1 - at) * h], [LEFT + w, TOP + (1 - at) * h]);
    }
    context.setLineDash([]);
    context.lineWidth = 1;
    if (picked >= 0 && chosen[picked] && xs[picked] === xs[picked] && ys[picked] === ys[picked]) {
      context.strokeStyle = ink;
      context.beginPath();
      context.arc(LEFT + xs[picked] * w, TOP + (1 - ys[picked]) * h, 6, 0, 7);
      context.stroke();
    }
  }
  // Bounds of the drawn quantities for the shown variants, with their columns.
  function bounds() {
    const own = only ? Number(only.value) - 1 : -1;
    const drawn = data.requirements.filter((one, k) => (own < 0 || applies[k][own]) && [across.value, up.value].includes(String(one.column)));
    return drawn.flatMap((one) => [one.below, one.above].filter((bound) => bound !== null).map((bound) => [one.column, bound]));
  }
  function legend() {
    key.textContent = "";
    const which = Number(colour.value) - 1;
    const words = which < 0 ? ["fails a requirement or did not complete", "passes"] : [`fails ${data.requirements[which].text}`, "passes"];
    const entry = (number, text) => {
      const box = make("span", key, "", { className: "entry" });
      make("span", box, "", { className: "swatch c" + number });
      box.append(text);
    };
    entry(1, words[0]);
    entry(0, words[1]);
    if (which >= 0 && passed[which].includes(NONE)) entry(6, "of another variant");
    const [inside, outside] = [[], []];
    for (const [column, bound] of bounds()) {
      const { name, unit, least, span } = columns[column];
      const at = (bound - least) / span;
      (at >= 0 && at <= 1 ? inside : outside).push(`${name} = ${figure(bound)} ${unit}`.trim());
    }
    if (inside.length) make("span", key, `– – bound: ${inside.join(", ")} `, { className: "entry" });
    if (outside.length) make("span", key, `bound beyond the axis: ${outside.join(", ")} `, { className: "entry" });
    if (missing) key.append(`${missing} of the selected runs have no number here.`);
  }

  // Runs by cells of the plot, for the one nearest to the pointer.
  const CELL = 16;
  function cells() {
    const [[w, h], xs, ys] = [inner(), columns[across.value].places, columns[up.value].places];
    const [nx, ny] = [Math.ceil(w / CELL) + 1, Math.ceil(h / CELL) + 1];
    const starts = new Uint32Array(nx * ny + 1);
    const cell = (k) => Math.floor((xs[k] * w) / CELL) + nx * Math.floor(((1 - ys[k]) * h) / CELL);
    const there = (k) => chosen[k] && xs[k] === xs[k] && ys[k] === ys[k];
    for (let k = 0; k < count; k++) if (there(k)) starts[cell(k) + 1]++;
    for (let k = 0; k < nx * ny; k++) starts[k + 1] += starts[k];
    const next = starts.slice(), runs = new Uint32Array(starts[nx * ny]);
    for (let k = 0; k < count; k++) if (there(k)) runs[next[cell(k)]++] = k;
    return { nx, ny, starts, runs, xs, ys, w, h };
  }
  function nearest(px, py) {
    grid ??= cells();
    const { nx, ny, starts, runs, xs, ys, w, h } = grid;
    const [cx, cy] = [Math.floor(px / CELL), Math.floor(py / CELL)];
    let [best, least] = [-1, CELL * CELL];
    for (let j = Math.max(0, cy - 1); j <= Math.min(ny - 1, cy + 1); j++) {
      for (let i = Math.max(0, cx - 1); i <= Math.min(nx - 1, cx + 1); i++) {
        for (let k = starts[i + nx * j]; k < starts[i + nx * j + 1]; k++) {
          const run = runs[k];
          const distance = (xs[run] * w - px) ** 2 + ((1 - ys[run]) * h - py) ** 2;
          if (distance < least) [best, least] = [run, distance];
        }
      }
    }
    return best;
  }

  const LOW = HEIGHT - 14 - LANE, HIGH = 58;
  const axisAt = (k) => (axes.length > 1 ? 60 + ((parallel.wide - 120) * k) / (axes.length - 1) : parallel.wide / 2);
  const level = (place) => (place === place ? LOW - place * (LOW - HIGH) : LOW + LANE);
  function lay() {
    axes = [...parameters, ...(measure ? [numbers[measure.value]] : [])];
    if (axes.length === 1) axes.push(axes[0]);
  }
  // A run as a line, counted pixel by pixel, as a function that draws one.
  function lines() {
    const { counts, behind, scale, layer: { width: pixels } } = parallel;
    const xs = axes.map((_, k) => Math.round(axisAt(k) * scale));
    const all = axes.map((k) => columns[k].places);
    return (run) => {
      const own = chosen[run];
      const into = own ? counts[fate[run] === 0 ? 0 : fate[run] === NONE ? 2 : 1] : behind;
      for (let k = 1; k < xs.length; k++) {
        const from = level(all[k - 1][run]) * scale, slope = (level(all[k][run]) * scale - from) / (xs[k] - xs[k - 1]);
        if (shown > 3000 || !own) {
          for (let x = xs[k - 1], y = from + 0.5; x < xs[k]; x++, y += slope) into[(y | 0) * pixels + x]++;
          continue;
        }
        // Few lines are closed where they are steep.
        for (let x = xs[k - 1], y = from + 0.5; x < xs[k]; x++, y += slope) {
          const [low, high] = [Math.min(y, y + slope) | 0, Math.max(y, y + slope) | 0];
          for (let r = low; r <= high; r++) into[r * pixels + x]++;
        }
      }
    };
  }
  function drawAxes() {
    const context = begin(parallel);
    const [ink, faint, accent, ground] = [style("--ink"), style("--faint"), style("--accent"), style("--paper")];
    const room = axes.length > 1 ? (parallel.wide - 120) / (axes.length - 1) : parallel.wide;
    const written = (text, x, y) => {
      context.lineWidth = 4;
      context.strokeStyle = ground;
      context.strokeText(text, x, y);
      context.lineWidth = 1;
      context.fillText(text, x, y);
    };
    axes.forEach((number, k) => {
      const [x, column] = [axisAt(k), columns[number]];
      context.fillStyle = ink;
      stroke(context, ink, [x, HIGH], [x, LOW]);
      const edge = k === 0 ? "left" : k === axes.length - 1 ? "right" : "center";
      context.textAlign = edge;
      const at = k === 0 ? 2 : k === axes.length - 1 ? parallel.wide - 2 : x;
      const wide = edge === "center" ? room - 8 : room / 2 + 54;
      context.fillText(cut(context, column.name, wide), at, 12);
      context.fillStyle = faint;
      if (column.unit) context.fillText(cut(context, `[${column.unit}]`, wide), at, 28);
      context.fillStyle = ink;
      context.textAlign = "center";
      if (column.some) {
        written(figure(column.least + column.span), x, HIGH - 8);
        written(figure(column.least), x, LOW + 15);
      }
      context.fillStyle = faint;
      if (column.gaps) written("no number", x, HEIGHT - 2);
      const range = brushes.get(number);
      if (range) {
        const [top, bottom] = [level(Math.min(1, range[1])), range[0] < 0 ? LOW + LANE : level(range[0])];
        context.fillStyle = accent;
        context.globalAlpha = 0.35;
        context.fillRect(x - 8, top, 16, Math.max(2, bottom - top));
        context.globalAlpha = 1;
        context.strokeStyle = accent;
        context.strokeRect(x - 8, top, 16, Math.max(2, bottom - top));
      }
    });
  }

  // The work is split into parts that fit into a frame; newer work replaces it.
  function* work() {
    choose();
    legend();
    grid = null;
    tip.hidden = true;
    [scatter, parallel].forEach(reset);
    const [point, line] = [points(), lines()];
    let drawn = 0;
    for (let done = 0; done < count; done++) {
      const run = order[done];
      point(run);
      // A part of the others is enough to show their positions.
      if (!chosen[run] && done >= 4000) continue;
      line(run);
      // A few are drawn at once.
      if (++drawn % 64 === 0 && count > 1000) yield drawn;
    }
    return drawn;
  }
  const BUDGET = 6;
  let [job, pending, turn] = [null, 0, 0];
  function advance(budget) {
    const begun = performance.now();
    job ??= work();
    let found;
    do found = job.next(); while (!found.done && performance.now() - begun < budget);
    // Failing runs stay visible, however few.
    const few = Math.min(found.value, failing);
    const both = found.done || turn++ % 2 === 0;
    // Painting takes as long as counting: points follow in every other frame.
    if (both) paint(scatter, [few, shown].map((count) => Math.min(0.9, Math.max(0.25, 40 / Math.sqrt(count)))));
    if (both) drawScatter();
    paint(parallel, [few, found.value].map((count) => Math.min(0.6, Math.max(0.003, 100 / Math.max(1, count)))));
    drawAxes();
    place.dataset.drawn = found.done ? "all" : found.value;
    if (found.done) job = null;
    return found.done;
  }
  function tick() {
    pending = 0;
    if (!advance(BUDGET)) pending = requestAnimationFrame(tick);
  }
  function schedule() {
    job = null;
    // Printing does not wait for the next frame.
    if (paper.matches) advance(Infinity);
    else if (!pending) pending = requestAnimationFrame(tick);
  }
  function changed(event) {
    if (event?.target === colour) judge();
    if (event?.target === measure) {
      lay();
      brushes = new Map([...brushes].filter(([column]) => axes.includes(column)));
    }
    schedule();
  }
  function sized() {
    if (place.clientWidth < 1) return;
    width = Math.max(280, place.clientWidth);
    ratio = paper.matches ? 2 : Math.min(2, window.devicePixelRatio || 1);
    lay();
    size(scatter, width);
    size(parallel, Math.max(width, 120 + ROOM * (axes.length - 1)));
    schedule();
  }

  const position = (event, canvas) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  scatter.canvas.addEventListener("pointermove", (event) => {
    const [x, y] = position(event, scatter.canvas);
    const run = nearest(x - LEFT, y - TOP);
    tip.hidden = run < 0;
    if (run < 0) return;
    const [across_, up_] = [columns[across.value], columns[up.value]];
    const value = (column) => `${column.name} = ${figure(column.from + column.values[run])} ${column.unit}`.trim();
    const rest = parameters.map((k) => columns[k]).filter((one) => one !== across_ && one !== up_);
    const head = `sample ${sample[run]}` + (data.variants.length > 1 ? `, ${data.variants[variant[run]]}` : "") + (ended[run] ? "" : ", did not complete");
    tip.textContent = [head, value(across_), value(up_), ...rest.slice(0, 8).map(value)].join("\n");
    tip.style.left = Math.min(x + 14, width - tip.offsetWidth - 4) + "px";
    tip.style.top = Math.max(0, Math.min(y + 14, HEIGHT - tip.offsetHeight - 4)) + "px";
  });
  scatter.canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
  const again = (run) => {
    const { command, block, files, variants } = data.again;
    const file = files[Math.floor(sample[run] / block)];
    return file ? `${command} ${file} --sample ${sample[run]}` + (variants.length ? ` --variant ${variants[variant[run]]}` : "") : "";
  };
  scatter.canvas.addEventListener("click", (event) => {
    const [x, y] = position(event, scatter.canvas);
    picked = nearest(x - LEFT, y - TOP);
    pinned.hidden = picked < 0;
    pinned.textContent = "";
    if (picked >= 0) {
      const own = data.variants.length > 1 ? `, ${data.variants[variant[picked]]}` : "";
      pinned.append(`Sample ${sample[picked]}${own}: `);
      if (again(picked)) copied(make("code", pinned, again(picked)));
    }
    drawScatter();
  });

  let drag = null;
  const place_ = (y) => {
    const at = (LOW - y) / (LOW - HIGH);
    return at > 1 ? 1 : at < -0.02 ? -1 : Math.max(0, at);
  };
  parallel.canvas.addEventListener("pointerdown", (event) => {
    const [x, y] = position(event, parallel.canvas);
    const near = axes.findIndex((_, k) => Math.abs(axisAt(k) - x) < 22);
    if (near < 0) return;
    drag = { axis: axes[near], from: place_(y), y };
    parallel.canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  parallel.canvas.addEventListener("pointermove", (event) => {
    const [x, y] = position(event, parallel.canvas);
    parallel.canvas.style.cursor = drag || axes.some((_, k) => Math.abs(axisAt(k) - x) < 22) ? "ns-resize" : "";
    if (!drag || Math.abs(y - drag.y) < 4) return;
    const to = place_(y);
    brushes.set(drag.axis, [Math.min(drag.from, to), Math.max(drag.from, to)]);
    drag.moved = true;
    schedule();
  });
  const drop = () => {
    if (drag && !drag.moved) { brushes.delete(drag.axis); schedule(); }
    drag = null;
  };
  parallel.canvas.addEventListener("pointerup", drop);
  parallel.canvas.addEventListener("pointercancel", drop);
  clear.addEventListener("click", () => { brushes.clear(); schedule(); });

  // A button that copies a command.
  function copied(code) {
    const button = make("button", code.parentElement, "copy", { type: "button", className: "copy" });
    const done = (word) => {
      button.textContent = word;
      setTimeout(() => { button.textContent = "copy"; }, 1500);
    };
    // If the page cannot use the clipboard, at least the text is selected.
    const select = () => {
      getSelection().selectAllChildren(code);
      done("chosen");
    };
    button.addEventListener("click", () => {
      if (navigator.clipboard) navigator.clipboard.writeText(code.textContent).then(() => done("copied"), select);
      else select();
    });
  }

  try {
    judge();
    sized();
    document.querySelectorAll("#cases td code").forEach((code) => code.textContent && copied(code));
  } catch (error) {
    document.documentElement.className = "";
    throw error;
  }
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", schedule);
  // Paper has its own colours.
  paper.addEventListener("change", sized);
  new ResizeObserver(() => { if (Math.max(280, place.clientWidth) !== width) sized(); }).observe(place);
})();
