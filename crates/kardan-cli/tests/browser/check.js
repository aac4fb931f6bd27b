"use strict";
(() => {
  const wrong = new Set();
  const file = location.pathname.split("/").pop();
  const paper = location.hash === "#print";
  const say = (mode, what) => wrong.add(`${file}, ${innerWidth} px, ${mode}: ${what}`);
  addEventListener("error", (event) => say("load", "script error: " + (event.message || event.type)));
  addEventListener("unhandledrejection", (event) => say("load", "script error: " + event.reason));
  document.addEventListener("securitypolicyviolation", (event) => say("load", "blocked: " + event.blockedURI));

  // Frames out of sight are given no time to draw the runs of a sweep.
  const inSight = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (draw) =>
    document.getElementById("samples-data") ? setTimeout(() => draw(performance.now()), 1) : inSight(draw);

  // The rules of a medium hold when it is looked at, whatever the browser's own is.
  const rules = [];
  const gather = (list) => {
    for (const rule of list) {
      if (!(rule instanceof CSSMediaRule)) continue;
      rules.push([rule, rule.media.mediaText]);
      gather(rule.cssRules);
    }
  };
  const show = (mode) => {
    for (const [rule, text] of rules) {
      const about = text.includes("print") ? "print" : text.includes("dark") ? "dark" : null;
      if (about) rule.media.mediaText = about === mode ? "all" : "not all";
    }
  };

  const named = (element) => {
    const id = element.id ? "#" + element.id : "";
    const part = element.closest("section, figure")?.id ?? "";
    return `<${element.localName}${id} class="${element.getAttribute("class") ?? ""}"> in ${part}: ` +
      (element.textContent ?? "").trim().slice(0, 40);
  };
  // What an ancestor scrolls or cuts on purpose does not widen the page.
  const held = (element) => {
    for (let one = element.parentElement; one && one !== document.body; one = one.parentElement) {
      if (getComputedStyle(one).overflowX !== "visible") return true;
    }
    return false;
  };
  const visible = (element) => element.checkVisibility() && element.getClientRects().length > 0;

  function look(mode) {
    const width = document.documentElement.clientWidth;
    if (document.documentElement.scrollWidth > width) {
      say(mode, `the page is ${document.documentElement.scrollWidth} px, wider than the page's ${width} px`);
    }
    for (const element of document.body.querySelectorAll("*")) {
      if (element.closest("svg") && element.localName !== "svg") continue;
      const box = element.getBoundingClientRect();
      if (box.width === 0 || !visible(element) || getComputedStyle(element).clipPath !== "none") continue;
      if ((box.right > width + 1 || box.left < -1) && !held(element)) say(mode, "wider than the page: " + named(element));
    }
    for (const figure of document.querySelectorAll("figure")) {
      if (!visible(figure)) continue;
      const title = figure.querySelector("h3, h4")?.textContent.trim();
      const chart = figure.querySelector(".chart");
      if (!title) say(mode, "a picture without a title: " + named(figure));
      if (chart) charted(mode, figure, chart);
      else if (!figure.querySelector("figcaption")?.textContent.trim()) say(mode, "a picture without a legend: " + named(figure));
    }
    for (const svg of document.querySelectorAll("svg")) {
      const text = [...svg.querySelectorAll("text")].find((text) => text.getBBox().width > 0 && cut(svg, text));
      if (visible(svg) && text) say(mode, `a text of a picture is cut: "${text.textContent}" in ${named(svg.closest("figure") ?? svg)}`);
      const small = mode === "print" ? null : [...svg.querySelectorAll("text")].find((text) => letters(svg, text) < 8);
      if (visible(svg) && small) say(mode, `letters of ${letters(svg, small).toFixed(1)} px: "${small.textContent}" in ${named(svg)}`);
    }
  }

  // Size of letters as they are seen.
  function letters(svg, text) {
    return parseFloat(getComputedStyle(text).fontSize) * (svg.getScreenCTM()?.a ?? 1);
  }

  // Whether a text of a picture lies beyond its edges.
  function cut(svg, text) {
    const [frame, box] = [svg.getBoundingClientRect(), text.getBoundingClientRect()];
    return box.left < frame.left - 2 || box.right > frame.right + 2 || box.top < frame.top - 2 || box.bottom > frame.bottom + 2;
  }

  function charted(mode, figure, chart) {
    const data = JSON.parse(document.getElementById("data").textContent);
    const plot = data.plots[chart.dataset.plot];
    if (!/\[[^\]]+\]/.test(plot.y) && plot.curves.length > 0) say(mode, "a chart without a unit: " + named(figure));
    if (mode === "print") {
      if (!visible(figure.querySelector("svg"))) say(mode, "a chart without its picture: " + named(figure));
      return;
    }
    if (!chart.querySelector("canvas")) say(mode, "an empty chart: " + named(figure));
    const legend = [...chart.querySelectorAll(".u-legend .u-label")].map((label) => label.textContent);
    for (const curve of plot.curves) {
      if (!legend.includes(curve.label)) say(mode, `"${curve.label}" is missing in the legend: ` + named(figure));
    }
  }

  // Whatever is zoomed to, every chart shows something of its own time, and all of it again after a reset.
  async function zoomed() {
    const element = document.getElementById("data");
    if (!element) return;
    const data = JSON.parse(element.textContent);
    const charts = [...document.querySelectorAll(".chart")].map((chart) => {
      const times = data.plots[chart.dataset.plot].curves.flatMap((curve) => curve.t).map((t) => t * data.clock.per_second);
      return [chart, Math.min(...times), Math.max(...times)];
    }).filter(([, first, last]) => first < last);
    const press = async (button, right) => {
      button.click();
      await new Promise((done) => setTimeout(done));
      for (const [chart, first, last] of charts) {
        const [from, until] = [Number(chart.dataset.from), Number(chart.dataset.until)];
        if (!right(from, until, first, last)) say("zoom", `"${button.textContent}" shows ${from} to ${until} of ${first} to ${last}`);
      }
    };
    const slack = 1e-9;
    const within = (from, until, first, last) => from < until && from >= first - slack && until <= last + slack;
    const whole = (from, until, first, last) => within(from, until, first, last) && until - from > (1 - slack) * (last - first);
    const [reset, ...buttons] = document.querySelector(".tools")?.querySelectorAll("button") ?? [];
    for (const button of buttons) await press(button, within);
    if (reset) await press(reset, whole);
  }

  // Runs of a sweep: drawn, told of where the pointer is, chosen along an axis and by variant, and run again by a command.
  async function sampled() {
    const element = document.getElementById("samples-data");
    if (!element) return;
    const [data, place] = [JSON.parse(element.textContent), document.getElementById("samples-plots")];
    const [scatter, parallel] = place.querySelectorAll("canvas");
    const drawn = async () => {
      for (let k = 0; k < 500; k++) {
        await new Promise((done) => setTimeout(done, 2));
        if (place.dataset.drawn === "all") return;
      }
      say("runs", "they are not drawn: " + place.dataset.drawn);
    };
    const send = (canvas, type, x, y) => {
      const box = canvas.getBoundingClientRect();
      canvas.dispatchEvent(new PointerEvent(type, { clientX: box.left + x, clientY: box.top + y, bubbles: true, pointerId: 1 }));
    };
    const hold = (what, right) => right || say("runs", what);
    await drawn();
    const inked = (canvas) => canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.filter((_, k) => k % 4 === 3).some((x) => x > 0);
    hold("a plot is empty", inked(scatter) && inked(parallel));
    hold("not all are chosen", Number(place.dataset.chosen) === data.count);
    const [tip, pinned] = [".tip", ".pinned"].map((one) => place.querySelector(one));
    let found = null;
    for (let y = 8; y < 340 && !found; y += 8) {
      for (let x = 80; x < scatter.clientWidth && !found; x += 8) {
        send(scatter, "pointermove", x, y);
        if (!tip.hidden) found = [x, y];
      }
    }
    hold("nothing is told where the pointer is", found && /^sample \d+, \w+\n.* = .*\n/.test(tip.textContent));
    if (found) send(scatter, "click", ...found);
    const code = pinned.querySelector("code")?.textContent ?? "";
    const told = tip.textContent.match(/^sample (\d+), (\w+)/) ?? [];
    hold(`"${code}" does not run ${told[0]} again`, code.endsWith(` --sample ${told[1]} --variant ${told[2]}`) && code.startsWith(data.again.command));
    hold("the command cannot be copied", pinned.querySelector("button"));
    send(scatter, "pointerleave", 0, 0);
    hold("what was told of a run stays", tip.hidden);
    const [variant, all] = [place.querySelectorAll("select")[3], place.querySelector(".choices button")];
    variant.value = "1";
    variant.dispatchEvent(new Event("change"));
    await drawn();
    hold("a variant is not chosen", Number(place.dataset.chosen) * data.variants.length === data.count);
    variant.value = "0";
    variant.dispatchEvent(new Event("change"));
    await drawn();
    // No pointer is down that could be captured.
    parallel.setPointerCapture = () => {};
    send(parallel, "pointerdown", 60, 100);
    send(parallel, "pointermove", 60, 200);
    send(parallel, "pointerup", 60, 200);
    await drawn();
    const part = Number(place.dataset.chosen);
    hold(`${part} of ${data.count} runs are chosen along an axis`, part > 0 && part < data.count && !all.disabled);
    all.click();
    await drawn();
    hold("not all are chosen again", Number(place.dataset.chosen) === data.count && all.disabled);
  }

  addEventListener("load", async () => {
    for (const sheet of document.styleSheets) gather(sheet.cssRules);
    document.querySelectorAll("details").forEach((details) => { details.open = true; });
    for (const mode of paper ? ["print"] : ["light", "dark"]) {
      show(mode);
      look(mode);
    }
    if (!paper) await zoomed();
    if (!paper) await sampled();
    parent.postMessage([...wrong], "*");
  });
})();
