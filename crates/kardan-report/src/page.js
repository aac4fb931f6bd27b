"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const scheme = window.matchMedia("(prefers-color-scheme: dark)");
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const minus = (text) => text.replace(/-/g, "−");
  const sync = uPlot.sync("kardan");
  const clock = data.clock;
  const shown = (time) => time * clock.per_second;
  let charts = [];

  // A value with five significant digits.
  const figure = (value) => {
    if (value === 0) return "0";
    const size = Math.abs(value);
    const text = size >= 1e6 || size < 1e-4 ? value.toExponential(4) : value.toPrecision(5);
    return minus(text);
  };

  // Tick labels with the digits that their distance needs.
  const ticks = (u, splits, axis, space, step) => splits.map((value) => {
    if (value === null) return "";
    const size = Math.max(...splits.map(Math.abs));
    if (Math.abs(value) < 1e-9 * size) return "0";
    if (size >= 1e6 || size < 1e-3) return minus(String(parseFloat(value.toPrecision(4)).toExponential()));
    const decimals = Math.min(12, Math.max(0, ...[0, 1, 2, 3, 4, 5, 6, 7, 8].filter((d) =>
      Math.abs(step * 10 ** d - Math.round(step * 10 ** d)) > 1e-6).map((d) => d + 1)));
    return minus(value.toFixed(decimals));
  });

  // Curves have their own time grids: take the nearest time with a value.
  const nearest = (u, series, index, time) => {
    const [x, y] = [u.data[0], u.data[series]];
    if (series === 0 || y[index] != null) return index;
    let [low, high] = [index, index];
    while (low >= 0 && y[low] === undefined) low--;
    while (high < y.length && y[high] === undefined) high++;
    if (low < 0 && high >= y.length) return null;
    // No values exist after the end of a run.
    if (low < 0 || high >= y.length) return null;
    return time - x[low] <= x[high] - time ? low : high;
  };

  const axisWidth = (u, values, index, cycle) => {
    const axis = u.axes[index];
    if (cycle > 1) return axis._size;
    const longest = (values ?? []).reduce((a, b) => (b.length > a.length ? b : a), "");
    u.ctx.font = axis.font[0];
    return Math.ceil(Math.max(44, u.ctx.measureText(longest).width / devicePixelRatio + axis.gap + axis.ticks.size + 4));
  };

  const height = (width) => Math.round(Math.min(420, Math.max(240, width * 0.4)));

  function draw(element, plot) {
    const joined = plot.curves.length
      ? uPlot.join(plot.curves.map((curve) => [curve.t.map(shown), curve.v]))
      : [[0, 1]];
    const ink = style("--ink");
    const font = "12px " + getComputedStyle(document.body).fontFamily;
    const axis = {
      stroke: ink, font, labelFont: "13px " + getComputedStyle(document.body).fontFamily, labelSize: 22, labelGap: 2,
      grid: { stroke: style("--grid"), width: 1 }, ticks: { stroke: style("--line"), width: 1, size: 5 }, values: ticks,
    };
    const colour = (curve) => (curve.colour === null ? ink : style("--curve-" + curve.colour));
    const lineStyle = (curve) => (!curve?.dash.length ? "solid" : curve.dash[0] < 2 ? "dotted" : "dashed");
    const series = plot.curves.map((curve) => ({
      label: curve.label,
      stroke: colour(curve),
      width: curve.width,
      dash: curve.dash,
      points: { show: false },
      pxAlign: 0,
      value: (u, value) => (value == null ? "" : figure(value) + " " + curve.unit),
    }));
    const options = {
      width: element.clientWidth,
      height: height(element.clientWidth),
      scales: {
        x: { time: false },
        // Values that are only rounding get an axis that shows them as flat.
        y: { range: (u, low, high) => {
          if (low === null || high === null) return [0, 1];
          const least = Math.max(plot.least_span, 1e-6 * Math.max(Math.abs(low), Math.abs(high)));
          const half = Math.max(least, 0.1 * Math.abs(low + high)) / 2;
          if (!(high - low >= least)) return [(low + high) / 2 - half, (low + high) / 2 + half];
          const [from, to] = uPlot.rangeNum(low, high, 0.1, true);
          // Its rounding is too coarse for small changes far from zero.
          return from <= low && high <= to ? [from, to] : [low - 0.1 * (high - low), high + 0.1 * (high - low)];
        } },
      },
      axes: [
        { ...axis, label: "time [" + clock.unit + "]", size: 28 },
        { ...axis, label: plot.y, size: axisWidth },
      ],
      series: [{ label: "time", value: (u, value) => (value == null ? "" : figure(value) + " " + clock.unit) }, ...series],
      legend: { markers: { dash: (u, index) => lineStyle(plot.curves[index - 1]), width: 2 } },
      // The shown range, for programs that read the page.
      hooks: { setScale: [(u, key) => {
        if (key === "x") [element.dataset.from, element.dataset.until] = [u.scales.x.min, u.scales.x.max];
      }] },
      cursor: { sync: { key: sync.key }, dataIdx: nearest, drag: { x: true, y: false, dist: 4 }, points: { size: 6 } },
    };
    const chart = new uPlot(options, joined, element);
    sync.sub(chart);
    return chart;
  }

  // A plot of a part of the time has no data outside: it shows its part of the zoomed range, and stays unchanged if that is empty.
  const ends = (chart) => [chart.data[0][0], chart.data[0][chart.data[0].length - 1]];
  const zoom = (from, to) => charts.forEach((chart) => {
    const [first, last] = ends(chart);
    const [min, max] = [Math.max(from, first), Math.min(to, last)];
    if (min < max) chart.setScale("x", { min, max });
  });
  const reset = () => charts.forEach((chart) => {
    const [min, max] = ends(chart);
    chart.setScale("x", { min, max });
  });

  function button(text, title, action) {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.title = title;
    made.addEventListener("click", action);
    return made;
  }

  function tools(element) {
    element.append(button("reset zoom", "show the whole time of all charts", reset));
    const marks = data.marks.map(shown);
    const own = charts.find((chart) => chart.root.parentElement.dataset.plot === element.dataset.plot);
    const [first, last] = own ? ends(own) : [0, Infinity];
    const end = Math.max(...charts.map((chart) => ends(chart)[1]));
    if (marks.some((mark) => mark >= first && mark < last)) element.append("zoom to");
    marks.forEach((mark, index) => {
      if (mark < first || mark >= last) return;
      const span = (marks[index + 1] ?? Math.max(end, mark + 1e-3)) - mark;
      const [from, to] = [Math.max(0, mark - 0.05 * span), mark + 0.3 * span];
      const unit = " " + clock.unit;
      const title = figure(from) + unit + " to " + figure(to) + unit;
      element.append(button(parseFloat(mark.toPrecision(4)) + unit, title, () => zoom(from, to)));
    });
  }

  function drawAll() {
    charts.forEach((chart) => { sync.unsub(chart); chart.destroy(); });
    charts = [...document.querySelectorAll(".chart")].map((element) => draw(element, data.plots[element.dataset.plot]));
  }

  try {
    drawAll();
    document.querySelectorAll(".tools").forEach(tools);
  } catch (error) {
    // The static pictures remain.
    document.documentElement.className = "";
    throw error;
  }
  scheme.addEventListener("change", drawAll);
  let pending = 0;
  window.addEventListener("resize", () => {
    clearTimeout(pending);
    pending = setTimeout(() => charts.forEach((chart) => {
      const width = chart.root.parentElement.clientWidth;
      if (width > 0) chart.setSize({ width, height: height(width) });
    }), 80);
  });
})();
