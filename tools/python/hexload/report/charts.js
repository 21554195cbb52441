"use strict";
// Draws every chart of the page from the data beside it (charts.py): panels with axes in plain numbers, a readout at the
// pointer, a drag that zooms all panels of a chart in time, a double click that undoes it.
(() => {
  const STEPS = 65534;
  const LEFT = 52, RIGHT = 8, TOP = 22, BOTTOM = 36, LETTER = 7;
  const INK = "#24292f", GRID = "#e4e7eb", AXIS = "#9aa3ad", BAND = "rgba(0, 114, 178, 0.16)", TRUTH = "#111418";
  const PAPER = { tall: 920, broad: 1200 }; // px across a printed A4 page, which makes its letters 6 points
  const VIRIDIS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

  const escaped = text => text.replace(/[&<>"]/g, mark => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", "\"": "&quot;" })[mark]);
  const decode = (text, [low, high]) => {
    const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    return Array.from(new Uint16Array(bytes.buffer), code => code > STEPS ? NaN : low + code * (high - low) / STEPS);
  };

  // Round numbers, and the digits that tell them apart: `most` at most, but three where room is for them, for one alone
  // or two are hardly a scale. `fits`: whether these ticks have room.
  function ticks(low, high, most, fits = () => true) {
    const rough = (high - low) / Math.max(most, 1), power = 10 ** Math.floor(Math.log10(rough));
    const steps = [10, 5, 2, 1, 0.5, 0.2].map(factor => factor * power);
    const place = steps.findLastIndex(each => each >= rough * 0.999), finer = steps.slice(place).map(step => multiples(step, low, high));
    return finer.find((found, k) => found.length >= 3 && (k === 0 || fits(found))) || finer[0];
  }
  function multiples(step, low, high) {
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
      found.push([k * step, (k * step + 0).toFixed(digits).replace("-", "−")]);
    }
    return found;
  }
  // Of a logarithmic axis: powers of ten, with as many between as have room; where it is short, round numbers.
  function logTicks(low, high, most) {
    const within = factors => {
      const found = [];
      for (let power = Math.floor(low); power <= Math.ceil(high); power++) {
        for (const factor of factors) {
          const at = power + Math.log10(factor);
          if (at >= low - 1e-9 && at <= high + 1e-9) found.push([at, scientific(factor, power)]);
        }
      }
      return found;
    };
    const choices = [[1, 2, 3, 5, 7], [1, 2, 5], [1, 3], [1]].map(within), found = choices.find(each => each.length <= most) || choices[3];
    if (found.length < 3) return ticks(10 ** low, 10 ** high, most).filter(([at]) => at > 0).map(([at, label]) => [Math.log10(at), label]);
    const every = Math.ceil(found.length / Math.max(most, 1));
    return found.filter((_, k) => k % every === 0);
  }
  const scientific = (factor, power) => power > -4 && power < 5 ? plain(factor * 10 ** power) :
    (factor === 1 ? "" : `${factor}·`) + "10" + String(power).replace(/./g, letter => "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"["0123456789-".indexOf(letter)]);
  const plain = number => !Number.isFinite(number) ? "–" : String(Number(number.toPrecision(5))).replace("-", "−");

  const SYMBOLS = [
    r => `M${-r},0a${r},${r} 0 1,0 ${2 * r},0a${r},${r} 0 1,0 ${-2 * r},0Z`,
    r => `M${-r},${-r}H${r}V${r}H${-r}Z`,
    r => `M0,${-1.3 * r}L${1.3 * r},0L0,${1.3 * r}L${-1.3 * r},0Z`,
    r => `M0,${-1.2 * r}L${1.15 * r},${0.9 * r}H${-1.15 * r}Z`,
    r => `M0,${1.2 * r}L${1.15 * r},${-0.9 * r}H${-1.15 * r}Z`,
    r => `M${-r / 3},${-r}H${r / 3}V${-r / 3}H${r}V${r / 3}H${r / 3}V${r}H${-r / 3}V${r / 3}H${-r}V${-r / 3}H${-r / 3}Z`,
  ];
  const symbol = (x, y, number, r, colour) =>
    `<path transform="translate(${x.toFixed(1)} ${y.toFixed(1)})" d="${SYMBOLS[number % SYMBOLS.length](r)}" fill="${colour}"/>`;

  function path(xs, ys, px, py, steps) {
    let text = "", pen = false, before = 0;
    for (let k = 0; k < xs.length; k++) {
      if (Number.isNaN(ys[k]) || Number.isNaN(xs[k])) { pen = false; continue; }
      const x = px(xs[k]).toFixed(1), y = py(ys[k]).toFixed(1);
      text += !pen ? `M${x},${y}` : steps ? `L${x},${before}L${x},${y}` : `L${x},${y}`;
      pen = true; before = y;
    }
    return text;
  }

  function drawSeries(series, px, py) {
    const dash = series.d ? ` stroke-dasharray="${series.d}"` : "", { xs, ys } = series;
    if (series.k === "band") {
      const back = xs.map((_, k) => xs.length - 1 - k);
      const outline = path([...xs, ...back.map(k => xs[k])], [...ys, ...back.map(k => series.hs[k])], px, py);
      return `<path d="${outline}Z" fill="${series.c}"/>`;
    }
    let text = "";
    if (series.k !== "dots") {
      text += `<path d="${path(xs, ys, px, py, series.k === "steps")}" fill="none" stroke="${series.c}" ` +
        `stroke-width="${series.w}" stroke-linejoin="round"${dash}/>`;
    }
    if (series.k === "dots" || series.k === "both") {
      xs.forEach((x, k) => { if (!Number.isNaN(ys[k])) text += symbol(px(x), py(ys[k]), series.s || 0, series.r, series.c); });
    }
    (series.l || []).forEach((label, k) => { // of a line's end: away from the line
      const [across, down] = [px(xs[k]) - px(xs[1 - k]), py(ys[k]) - py(ys[1 - k])], share = 13 / (Math.hypot(across, down) || 1);
      if (label) text += `<text x="${px(xs[k]) + share * across}" y="${py(ys[k]) + share * down + 4}" fill="${INK}" text-anchor="middle">${escaped(label)}</text>`;
    });
    return text;
  }

  function colour(share) {
    const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1), k = Math.min(Math.floor(place), VIRIDIS.length - 2);
    return `rgb(${VIRIDIS[k].map((from, c) => Math.round(from + (VIRIDIS[k + 1][c] - from) * (place - k))).join(",")})`;
  }
  function drawCells(cells, px, py) {
    const [low, high] = cells.kept, dx = px(cells.x[1]) - px(cells.x[0]), dy = py(cells.y[0]) - py(cells.y[1]);
    return cells.values.map((value, k) => {
      if (Number.isNaN(value)) return "";
      const x = px(cells.x[k % cells.x.length]) - dx / 2, y = py(cells.y[Math.floor(k / cells.x.length)]) - dy / 2;
      return `<rect x="${x.toFixed(2)}" y="${y.toFixed(2)}" width="${(dx + 0.4).toFixed(2)}" height="${(dy + 0.4).toFixed(2)}" fill="${colour((value - low) / (high - low))}"/>`;
    }).join("") + `<path transform="translate(${px(0)} ${py(0)})" d="M-6,0H6M0,-6V6" stroke="white" stroke-width="1.5"/>`;
  }

  // The range of y that what is in sight needs.
  function sight(panel, [low, high]) {
    let bottom = Infinity, top = -Infinity;
    for (const each of panel.series || []) {
      each.xs.forEach((x, k) => {
        if (x < low || x > high) return;
        for (const y of [each.ys[k], each.hs ? each.hs[k] : each.ys[k]]) {
          if (y < bottom) bottom = y;
          if (y > top) top = y;
        }
      });
    }
    if (!(top > bottom)) return panel.y;
    return [bottom - 0.06 * (top - bottom), top + 0.06 * (top - bottom)];
  }

  function draw(panel, zoom, width = panel.place.clientWidth) {
    const height = panel.height;
    if (!width) return;
    const isZoomed = zoom && panel.xt === "time, s";
    let x = isZoomed ? zoom : panel.x, y = isZoomed ? sight(panel, zoom) : panel.y;
    const right = panel.cells ? RIGHT + 44 : RIGHT, left = LEFT + (panel.yt ? 14 : 0);
    const across = width - left - right, up = height - TOP - BOTTOM;
    if (panel.same) { // the axis that has room to spare becomes longer
      const scale = Math.max((x[1] - x[0]) / across, (y[1] - y[0]) / up);
      const wide = (scale * across - (x[1] - x[0])) / 2, high = (scale * up - (y[1] - y[0])) / 2;
      x = [x[0] - wide, x[1] + wide]; y = [y[0] - high, y[1] + high];
    }
    const px = value => left + (value - x[0]) / (x[1] - x[0]) * across;
    const py = value => TOP + (y[1] - value) / (y[1] - y[0]) * up;
    const fits = found => found.every(([, label]) => (label.length + 1.5) * LETTER < across / found.length);
    const xTicks = panel.names ? panel.names.map((name, k) => [k, name]) : panel.xl ? logTicks(...x, across / 40) : ticks(...x, across / 70, fits);
    const yTicks = panel.yl ? logTicks(...y, up / 24) : ticks(...y, up / 26);
    const slanted = panel.names && panel.names.some(name => name.length * LETTER > across / panel.names.length);
    let text = `<text x="${left}" y="13" class="title">${escaped(panel.title || "")}</text>`;
    for (const [at, label] of yTicks) {
      text += `<path d="M${left},${py(at).toFixed(1)}H${width - right}" stroke="${GRID}"/>` +
        `<text x="${left - 6}" y="${(py(at) + 4).toFixed(1)}" text-anchor="end">${label}</text>`;
    }
    for (const [at, label] of xTicks) {
      const middle = px(at).toFixed(1), below = height - BOTTOM + 14;
      text += panel.names ? "" : `<path d="M${middle},${TOP}V${height - BOTTOM}" stroke="${GRID}"/>`;
      text += slanted ? `<text transform="translate(${middle} ${below}) rotate(-18)" text-anchor="end">${escaped(label)}</text>` :
        `<text x="${Math.min(middle, width - 0.5 * LETTER * label.length)}" y="${below}" text-anchor="middle">${escaped(label)}</text>`;
    }
    text += `<text x="${left + across / 2}" y="${height - 6}" text-anchor="middle" class="quiet">${escaped(panel.xt || "")}</text>`;
    if (panel.yt) text += `<text transform="translate(12 ${TOP + up / 2}) rotate(-90)" text-anchor="middle" class="quiet">${escaped(panel.yt)}</text>`;
    let inside = "";
    const log = value => panel.yl ? Math.log10(value) : value;
    if (panel.shade) inside += `<rect x="${left}" y="${py(log(panel.shade[1]))}" width="${across}" height="${py(log(panel.shade[0])) - py(log(panel.shade[1]))}" fill="${BAND}"/>`;
    if (panel.cells) inside += drawCells(panel.cells, px, py);
    for (const each of panel.series || []) inside += drawSeries(each, px, py);
    for (const level of panel.levels || []) inside += `<path d="M${left},${py(log(level))}h${across}" stroke="${TRUTH}" stroke-dasharray="5 4"/>`;
    for (const [at, stroke, name] of panel.marks || []) {
      inside += `<path d="M${px(at)},${TOP}v${up}" stroke="${stroke}" stroke-width="1.6" stroke-dasharray="4 3"><title>${escaped(name)} at ${plain(at)} s</title></path>`;
    }
    const clip = `clip-${panel.number}`;
    text += `<clipPath id="${clip}"><rect x="${left}" y="${TOP}" width="${across}" height="${up}"/></clipPath><g clip-path="url(#${clip})">${inside}</g>`;
    text += `<path d="M${left},${TOP}V${height - BOTTOM}H${width - right}" fill="none" stroke="${AXIS}"/>`;
    if (panel.cells) text += scaleOf(panel.cells, width - right + 8, up);
    panel.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    panel.svg.innerHTML = text;
    panel.view = { x, y, px, py, left, right: width - right };
  }
  function scaleOf(cells, left, up) {
    const [low, high] = cells.kept, parts = 24;
    let text = `<text x="${left + 36}" y="13" class="quiet" text-anchor="end">${escaped(cells.title)}</text>`;
    for (let k = 0; k < parts; k++) text += `<rect x="${left}" y="${TOP + up * k / parts}" width="9" height="${up / parts + 0.5}" fill="${colour(1 - k / parts)}"/>`;
    for (const [at, label] of ticks(low, high, 5)) text += `<text x="${left + 13}" y="${TOP + (high - at) / (high - low) * up + 4}">${label}</text>`;
    return text;
  }

  // The point of a curve that is nearest to the pointer, in words.
  function nearest(panel, x, y) {
    let best = null, least = 40 * 40;
    for (const each of panel.series || []) {
      if (each.k === "band") continue;
      each.xs.forEach((at, k) => {
        const dx = panel.view.px(at) - x, dy = panel.view.py(each.ys[k]) - y, far = 4 * dx * dx + dy * dy;
        if (far < least) { least = far; best = [each, k]; }
      });
    }
    if (!best) return null;
    const [series, k] = best, at = panel.xl ? 10 ** series.xs[k] : series.xs[k], value = panel.yl ? 10 ** series.ys[k] : series.ys[k];
    const where = panel.names ? panel.names[Math.round(at)] : plain(at) + (panel.xt === "time, s" ? " s" : "");
    return [`${series.n ? series.n + ": " : ""}${plain(value)} at ${where}`, panel.view.px(series.xs[k]), panel.view.py(series.ys[k])];
  }

  function listen(chart, panel) {
    const place = panel.place, readout = place.appendChild(document.createElement("output"));
    let from = null;
    const inPanel = event => event.clientX - place.getBoundingClientRect().left;
    const toTime = x => panel.view.x[0] + (x - panel.view.left) / (panel.view.right - panel.view.left) * (panel.view.x[1] - panel.view.x[0]);
    place.addEventListener("pointermove", event => {
      const found = panel.view && nearest(panel, inPanel(event), event.clientY - place.getBoundingClientRect().top);
      readout.textContent = found ? found[0] : "";
      if (!found) return;
      readout.style.left = `${Math.min(found[1] + 8, Math.max(0, place.clientWidth - readout.offsetWidth))}px`;
      readout.style.top = `${Math.max(found[2] - 26, 0)}px`;
    });
    place.addEventListener("pointerleave", () => { readout.textContent = ""; });
    place.addEventListener("pointerdown", event => { from = event.pointerType === "touch" ? null : inPanel(event); });
    addEventListener("pointerup", event => {
      if (from === null) return;
      const ends = [toTime(from), toTime(inPanel(event))].sort((a, b) => a - b), far = Math.abs(inPanel(event) - from) > 6;
      from = null;
      if (!far || panel.xt !== "time, s") return;
      chart.zoom = ends;
      chart.panels.forEach(each => draw(each, chart.zoom));
    });
    place.addEventListener("dblclick", () => { chart.zoom = null; chart.panels.forEach(each => draw(each, null)); });
  }

  let number = 0;
  function open(element) {
    const place = element.querySelector(".panels"), height = parseFloat(getComputedStyle(place).getPropertyValue("--height"));
    const chart = { zoom: null, panels: JSON.parse(element.querySelector("script").textContent) };
    for (const panel of chart.panels) {
      for (const each of panel.series || []) {
        each.xs = decode(each.x, panel.kx); each.ys = decode(each.y, panel.ky);
        if (each.h) each.hs = decode(each.h, panel.ky);
      }
      if (panel.cells) panel.cells.values = decode(panel.cells.v, panel.cells.kept);
      panel.number = number++; panel.height = height;
      panel.place = place.appendChild(document.createElement("div"));
      panel.place.className = panel.row ? "panel first" : "panel";
      panel.svg = panel.place.appendChild(document.createElementNS("http://www.w3.org/2000/svg", "svg"));
      listen(chart, panel);
    }
    const redraw = () => chart.panels.forEach(panel => draw(panel, chart.zoom));
    redraw();
    new ResizeObserver(redraw).observe(place);
    // For the paper, whatever the window: letters keep their size.
    const columns = parseInt(getComputedStyle(place).getPropertyValue("--columns"), 10);
    const paper = place.closest(".broad") ? PAPER.broad : PAPER.tall;
    addEventListener("beforeprint", () => chart.panels.forEach(panel => draw(panel, chart.zoom, paper / columns)));
    addEventListener("afterprint", redraw);
  }

  for (const swatch of document.querySelectorAll("svg.swatch")) {
    const look = JSON.parse(swatch.dataset.look), series = { ...look, r: 4, xs: [0, 1], ys: [0, 0], hs: [1, 1] };
    if (look.k === "dots") { series.xs = [0.5]; series.ys = [0]; }
    if (look.k === "mark") series.k = "line";
    swatch.innerHTML = drawSeries(series, x => 1 + 20 * x, y => look.k === "band" ? 11 - 10 * y : 6);
  }
  document.querySelectorAll(".chart").forEach(open);
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(details => { details.open = true; }));
})();
