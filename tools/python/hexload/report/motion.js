"use strict";
// The animated view of a run (motion.py): base, legs in the colour of their force, platform, true and estimated load. A drag
// turns it. It plays when it comes into sight, unless the reader's system asks for less motion.
(() => {
  const STEPS = 65534, INK = "#24292f", MACHINE = "#9aa3ad", ESTIMATE = "#0072b2", TRUE = "#d55e00";
  const VIRIDIS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  const EDGES = [[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
  const decode = ({ v, kept: [low, high] }) => Array.from(
    new Uint16Array(Uint8Array.from(atob(v), letter => letter.charCodeAt(0)).buffer),
    code => code > STEPS ? NaN : low + code * (high - low) / STEPS);
  function colour(share) {
    if (Number.isNaN(share)) return MACHINE;
    const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1), k = Math.min(Math.floor(place), VIRIDIS.length - 2);
    return `rgb(${VIRIDIS[k].map((from, c) => Math.round(from + (VIRIDIS[k + 1][c] - from) * (place - k))).join(",")})`;
  }
  // Rz(yaw) Ry(pitch) Rx(roll)
  function rotation(roll, pitch, yaw) {
    const [sr, cr, sp, cp, sy, cy] = [Math.sin(roll), Math.cos(roll), Math.sin(pitch), Math.cos(pitch), Math.sin(yaw), Math.cos(yaw)];
    return [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]];
  }
  const turned = (matrix, vector) => matrix.map(row => row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2]);
  const sum = (...vectors) => [0, 1, 2].map(axis => vectors.reduce((total, vector) => total + vector[axis], 0));
  const around = points => points.map((_, k) => k).sort((a, b) => Math.atan2(points[a][1], points[a][0]) - Math.atan2(points[b][1], points[b][0]));

  function open(element) {
    const data = JSON.parse(element.querySelector("script").textContent);
    const [canvas, button, slider, output] = ["canvas", "button", "input", "output"].map(name => element.querySelector(name));
    const pose = decode(data.pose), force = decode(data.force), loads = [[decode(data.true), TRUE, 4], [decode(data.estimated), ESTIMATE, 1.5]];
    const reach = Math.max(...data.base.map(([x, y]) => Math.hypot(x, y)));
    // How high the loads reach over the platform.
    const top = Math.max(0.3 * reach, ...loads.flatMap(([shapes]) => Array.from({ length: shapes.length / 12 }, (_, k) =>
      shapes[12 * k + 2] + [5, 8, 11].reduce((sum, edge) => sum + Math.abs(shapes[12 * k + edge] || 0), 0))).filter(Number.isFinite));
    const rings = [around(data.base), around(data.platform)];
    const context = canvas.getContext("2d");
    let turn = -0.94, row = 0, playing = false, before = 0, place = 0, last = null;
    slider.max = data.frames - 1;

    function draw() {
      const width = canvas.clientWidth, height = canvas.clientHeight, dense = devicePixelRatio || 1;
      canvas.width = width * dense; canvas.height = height * dense;
      context.setTransform(dense, 0, 0, dense, 0, 0);
      const middle = 0.5 * (data.home + top), size = Math.min(width / (2.6 * reach), height / (1.15 * (data.home + top) + 0.8 * reach));
      const [s, c] = [Math.sin(turn), Math.cos(turn)], tilt = 0.32, [st, ct] = [Math.sin(tilt), Math.cos(tilt)], far = 6 * (reach + data.home);
      const project = ([x, y, z]) => {
        const right = c * x + s * y, depth = -s * x + c * y, up = z - middle, near = far / (far + depth * ct - up * st);
        return [width / 2 + size * near * right, height / 2 - size * near * (up * ct + depth * st)];
      };
      const stroke = (points, style, thick, closed) => {
        context.beginPath();
        points.forEach((point, k) => context[k ? "lineTo" : "moveTo"](...project(point)));
        if (closed) context.closePath();
        context.strokeStyle = style; context.lineWidth = thick; context.stroke();
      };
      const fill = style => { context.fillStyle = style; context.fill(); };
      const numbers = pose.slice(6 * row, 6 * row + 6);
      if (!numbers.some(Number.isNaN)) last = numbers;
      const [x, y, z, ...angles] = last || [0, 0, 0, 0, 0, 0], matrix = rotation(...angles), centre = [x, y, z + data.home];
      const heads = data.platform.map(point => sum(centre, turned(matrix, point)));
      context.lineJoin = context.lineCap = "round";
      context.clearRect(0, 0, width, height);
      stroke(rings[0].map(k => data.base[k]), MACHINE, 2, true); fill("rgba(154, 163, 173, 0.25)");
      const [low, high] = data.force.kept;
      data.base.forEach((foot, leg) => {
        stroke([foot, heads[leg]], INK, 7); stroke([foot, heads[leg]], colour((force[6 * row + leg] - low) / (high - low)), 5);
      });
      data.base.forEach((foot, leg) => { // over the legs behind them
        const [left, up] = project(foot.map((part, axis) => axis < 2 ? 1.13 * part : part));
        context.font = "12px system-ui, sans-serif"; context.textAlign = "center"; context.strokeStyle = "#fff"; context.lineWidth = 4;
        context.strokeText(leg + 1, left, up + 4); context.fillStyle = INK; context.fillText(leg + 1, left, up + 4);
      });
      stroke(rings[1].map(k => heads[k]), INK, 2, true); fill("rgba(154, 163, 173, 0.75)");
      for (const [shapes, style, thick] of loads) {
        const shape = shapes.slice(12 * row, 12 * row + 12), com = shape.slice(0, 3);
        if (!shape.length || com.some(Number.isNaN)) continue;
        const inBase = point => sum(centre, turned(matrix, point));
        if (!shape.some(Number.isNaN)) {
          const corners = Array.from({ length: 8 }, (_, k) => inBase(sum(com, ...[0, 1, 2].map(edge =>
            shape.slice(3 + 3 * edge, 6 + 3 * edge).map(part => k >> edge & 1 ? part : -part)))));
          EDGES.forEach(([a, b]) => stroke([corners[a], corners[b]], style, thick));
        }
        const [left, up] = project(inBase(com));
        context.beginPath(); context.arc(left, up, 2 + thick, 0, 2 * Math.PI); fill(style);
      }
      const t = data.duration * row / (data.frames - 1), changed = data.changes.filter(at => at <= t).length;
      output.textContent = `t = ${t.toFixed(2)} s   ${data.words[row]}${changed ? `; ${changed === 1 ? "another load" : `${changed} other loads`} detected` : ""}`;
      slider.value = row;
    }
    function step(now) {
      if (!playing) return;
      place += (now - before) / 1000 * data.speed; before = now;
      if (place >= data.duration) place = 0;
      row = Math.min(Math.round(place / data.duration * (data.frames - 1)), data.frames - 1);
      draw();
      requestAnimationFrame(step);
    }
    function play(on) {
      if (on === playing) return;
      playing = on; button.textContent = on ? "Pause" : "Play"; before = performance.now();
      if (on) requestAnimationFrame(step);
    }
    button.textContent = "Play";
    button.addEventListener("click", () => play(!playing));
    slider.addEventListener("input", () => { play(false); row = Number(slider.value); place = data.duration * row / (data.frames - 1); draw(); });
    let from = null;
    canvas.addEventListener("pointerdown", event => { from = event.clientX; });
    addEventListener("pointermove", event => { if (from !== null) { turn += (event.clientX - from) / 150; from = event.clientX; draw(); } });
    addEventListener("pointerup", () => { from = null; });
    addEventListener("beforeprint", () => { play(false); row = data.frames - 1; draw(); });
    new ResizeObserver(draw).observe(canvas);
    row = data.frames - 1; draw(); // the end, until it plays
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) {
      new IntersectionObserver(([seen], watch) => { if (seen.isIntersecting) { watch.disconnect(); play(true); } }, { threshold: 0.6 }).observe(canvas);
    }
  }
  document.querySelectorAll(".motion").forEach(open);
})();
