// The crack viewer: one sample, break by break, on a canvas, with its load curve beside it.
// Lengths on canvases are in CSS pixels; the canvases themselves are devicePixelRatio times finer.
"use strict";

(function () {
  const element = (id) => document.getElementById(id);
  const samples = JSON.parse(element("crack-data").textContent);
  if (!samples.length) return;

  const INTACT = "#d9d9d9", MARK = "#000000";
  const SHADES = 24;      // of each side of the peak
  const WHOLE = 24;       // seconds that playing a whole sample takes at speed 1
  const slider = element("crack-slider"), play = element("crack-play"), speed = element("crack-speed");
  const status = element("crack-status"), choice = element("crack-choice");
  const lattice = element("crack-lattice"), curve = element("crack-curve");
  let sample, shown = 0, playing = false, exact = 0, before = 0;

  function unpack(text, Kind) {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
    return new Kind(bytes.buffer);
  }

  function mix(from, to, share) {
    return "rgb(" + from.map((c, i) => Math.round(c + (to[i] - c) * share)).join(",") + ")";
  }

  const shades = (from, to) => Array.from({length: SHADES}, (_, i) => mix(from, to, i / (SHADES - 1)));
  const BEFORE = shades([140, 205, 245], [8, 48, 130]);  // light to dark blue
  const AFTER = shades([255, 190, 60], [170, 20, 10]);   // yellow to red

  // Colour of break k (from 0), by the share of the way to the peak, or from there to failure.
  function colour(k) {
    const last = sample.broken.length;
    const share = k < sample.peak ? k / sample.peak : (k - sample.peak) / Math.max(1, last - sample.peak);
    return (k < sample.peak ? BEFORE : AFTER)[Math.min(SHADES - 1, Math.floor(share * SHADES))];
  }

  // Ends of every bond: the first node and the nearest image in x of the second.
  function segments(data) {
    const p = unpack(data.positions, Float32Array), bonds = unpack(data.bonds, Int32Array);
    const ends = new Float32Array(2 * bonds.length);
    for (let i = 0; i < bonds.length; i += 2) {
      const a = 2 * bonds[i], b = 2 * bonds[i + 1];
      let dx = p[b] - p[a];
      if (data.period > 0) dx -= data.period * Math.ceil(dx / data.period - 0.5);
      ends.set([p[a], p[a + 1], p[a] + dx, p[b + 1]], 2 * i);
    }
    return ends;
  }

  function load(number) {
    const data = samples[number];
    sample = {name: data.name, peak: data.peak, tail: data.tail, ends: segments(data),
              broken: unpack(data.broken, Int32Array), load: unpack(data.load, Float32Array),
              displacement: unpack(data.displacement, Float32Array), envelope: unpack(data.envelope, Float32Array),
              loadLabel: data.loadLabel, displacementLabel: data.displacementLabel};
    slider.max = sample.broken.length;
    layOut();
    show(sample.peak);
  }

  function fit(canvas) {
    const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
    canvas.width = Math.round(box.width * ratio);
    canvas.height = Math.round(box.height * ratio);
    const layer = document.createElement("canvas");
    layer.width = canvas.width;
    layer.height = canvas.height;
    const pen = layer.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    return {canvas, layer, pen, width: box.width, height: box.height, ratio};
  }

  // Everything that depends on the size of the window: both canvases with what never changes on them.
  function layOut() {
    const view = fit(lattice);
    let [left, right, bottom, top] = [Infinity, -Infinity, Infinity, -Infinity];
    for (let i = 0; i < sample.ends.length; i += 2) {
      left = Math.min(left, sample.ends[i]); right = Math.max(right, sample.ends[i]);
      bottom = Math.min(bottom, sample.ends[i + 1]); top = Math.max(top, sample.ends[i + 1]);
    }
    const margin = 6, scale = Math.min((view.width - 2 * margin) / (right - left),
                                       (view.height - 2 * margin) / Math.max(top - bottom, 1e-9));
    const x0 = (view.width - scale * (right - left)) / 2 - scale * left;
    const y0 = (view.height + scale * (top - bottom)) / 2 + scale * bottom;
    const screen = new Float32Array(sample.ends.length);
    for (let i = 0; i < screen.length; i += 2) {
      screen[i] = x0 + scale * sample.ends[i];
      screen[i + 1] = y0 - scale * sample.ends[i + 1];
    }
    view.screen = screen;
    view.bold = Math.max(1.2, Math.min(4, 0.35 * scale));
    view.base = fit(lattice).layer;
    const pen = view.base.getContext("2d");
    pen.strokeStyle = INTACT;
    pen.lineWidth = Math.max(0.4, 0.3 * view.bold);
    pen.beginPath();
    for (let e = 0; e < screen.length; e += 4) {
      pen.moveTo(screen[e], screen[e + 1]);
      pen.lineTo(screen[e + 2], screen[e + 3]);
    }
    pen.stroke();
    view.drawn = -1;
    sample.view = view;
    sample.plot = fit(curve);
    drawAxes(sample.plot);
  }

  // Breaks from..to (exclusive) onto the layer; runs of one shade are one path.
  function drawBroken(view, from, to) {
    view.pen.lineWidth = view.bold;
    view.pen.lineCap = "round";
    for (let k = from; k < to;) {
      const shade = colour(k);
      view.pen.strokeStyle = shade;
      view.pen.beginPath();
      for (; k < to && colour(k) === shade; ++k) {
        const e = 4 * sample.broken[k];
        view.pen.moveTo(view.screen[e], view.screen[e + 1]);
        view.pen.lineTo(view.screen[e + 2], view.screen[e + 3]);
      }
      view.pen.stroke();
    }
  }

  // A step forward draws only the new breaks; a step back starts from the intact lattice.
  function drawLattice() {
    const view = sample.view;
    if (view.drawn < 0 || shown < view.drawn) {
      view.pen.clearRect(0, 0, view.width, view.height);
      view.pen.drawImage(view.base, 0, 0, view.width, view.height);
      view.drawn = 0;
    }
    drawBroken(view, view.drawn, shown);
    view.drawn = shown;
    const pen = view.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, view.canvas.width, view.canvas.height);
    pen.drawImage(view.layer, 0, 0);
    if (!shown) return;
    const e = 4 * sample.broken[shown - 1];
    pen.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
    pen.strokeStyle = MARK;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.arc((view.screen[e] + view.screen[e + 2]) / 2, (view.screen[e + 1] + view.screen[e + 3]) / 2, 7, 0, 7);
    pen.stroke();
  }

  function ticks(largest) {
    const rough = largest / 5, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough);
    return Array.from({length: Math.floor(largest / step) + 1}, (_, i) => +(i * step).toPrecision(6));
  }

  function drawAxes(plot) {
    const furthest = sample.displacement.reduce((a, b) => Math.max(a, b), 0);
    const box = {left: 52, right: plot.width - 12, top: 10, bottom: plot.height - 42};
    const u = Math.min(1.05 * furthest, sample.tail), p = 1.08 * sample.load[sample.peak - 1];
    plot.x = (value) => box.left + Math.min(1, value / u) * (box.right - box.left);
    plot.y = (value) => box.bottom - value / p * (box.bottom - box.top);
    const pen = plot.pen;
    pen.font = "12px sans-serif";
    pen.fillStyle = pen.strokeStyle = "#333";
    pen.strokeRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    pen.textAlign = "center";
    for (const t of ticks(u)) {
      pen.fillRect(plot.x(t), box.bottom - 4, 1, 4);
      pen.fillText(t, plot.x(t), box.bottom + 15);
    }
    pen.fillText(sample.displacementLabel, (box.left + box.right) / 2, box.bottom + 34);
    pen.textAlign = "right";
    for (const t of ticks(p)) {
      pen.fillRect(box.left, plot.y(t), 4, 1);
      pen.fillText(t, box.left - 5, plot.y(t) + 4);
    }
    pen.save();
    pen.translate(13, (box.top + box.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText(sample.loadLabel, 0, 0);
    pen.restore();
    for (let k = 0; k < sample.load.length; ++k) {
      if (sample.displacement[k] > u) continue;
      pen.fillStyle = colour(k);
      pen.fillRect(plot.x(sample.displacement[k]) - 1, plot.y(sample.load[k]) - 1, 2, 2);
    }
    pen.beginPath();
    for (let i = 0; i < sample.envelope.length; i += 2) {
      pen.lineTo(plot.x(sample.envelope[i]), plot.y(sample.envelope[i + 1]));
    }
    pen.stroke();
  }

  function drawMarker() {
    const plot = sample.plot, pen = plot.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, plot.canvas.width, plot.canvas.height);
    pen.drawImage(plot.layer, 0, 0);
    if (!shown) return;
    pen.setTransform(plot.ratio, 0, 0, plot.ratio, 0, 0);
    const x = plot.x(sample.displacement[shown - 1]), y = plot.y(sample.load[shown - 1]);
    pen.beginPath();
    pen.arc(x, y, 6, 0, 7);
    pen.fillStyle = colour(shown - 1);
    pen.fill();
    pen.lineWidth = 2;
    pen.strokeStyle = MARK;
    pen.stroke();
  }

  function describe() {
    const total = sample.broken.length;
    if (!shown) return "intact; " + total + " breaks to come, the peak load at number " + sample.peak;
    const k = shown - 1;
    const side = shown < sample.peak ? "before the peak" : shown === sample.peak ? "peak load" : "after the peak";
    return "break " + shown + " of " + total + " (" + side + "): bond " + sample.broken[k] + ", load " +
           sample.load[k].toPrecision(4) + ", displacement " + sample.displacement[k].toPrecision(4);
  }

  function show(number) {
    shown = Math.max(0, Math.min(sample.broken.length, Math.round(number)));
    slider.value = shown;
    slider.setAttribute("aria-valuetext", describe());
    status.textContent = describe();
    drawLattice();
    drawMarker();
  }

  function setPlaying(on) {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (shown >= sample.broken.length) show(0);
    exact = shown;
    before = performance.now();
    requestAnimationFrame(step);
  }

  function step(now) {
    if (!playing) return;
    exact += (now - before) / 1000 * sample.broken.length / WHOLE * Number(speed.value);
    before = now;
    if (Math.floor(exact) !== shown) show(Math.floor(exact));
    if (shown >= sample.broken.length) setPlaying(false); else requestAnimationFrame(step);
  }

  // Space plays and pauses, arrows step (with Shift: ten), Page Up and Down go by a twentieth, P goes to the peak.
  function press(event) {
    if (event.target.tagName === "SELECT" || event.ctrlKey || event.altKey || event.metaKey) return;
    const far = Math.max(1, Math.round(sample.broken.length / 20)), one = event.shiftKey ? 10 : 1;
    const jumps = {ArrowRight: shown + one, ArrowUp: shown + one, ArrowLeft: shown - one, ArrowDown: shown - one,
                   PageUp: shown + far, PageDown: shown - far, Home: 0, End: sample.broken.length,
                   p: sample.peak, P: sample.peak};
    if (event.key === " ") setPlaying(!playing);
    else if (event.key in jumps) { setPlaying(false); show(jumps[event.key]); }
    else return;
    event.preventDefault();
  }

  samples.forEach((data, i) => choice.add(new Option(data.name, i)));
  choice.addEventListener("change", () => { setPlaying(false); load(Number(choice.value)); });
  slider.addEventListener("input", () => { setPlaying(false); show(Number(slider.value)); });
  play.addEventListener("click", () => setPlaying(!playing));
  element("crack-peak").addEventListener("click", () => { setPlaying(false); show(sample.peak); });
  element("crack").addEventListener("keydown", press);
  // A button takes the key's release for a click: space on it would play and pause at once.
  element("crack").addEventListener("keyup", (event) => {
    if (event.key === " " && event.target.tagName === "BUTTON") event.preventDefault();
  });
  window.addEventListener("resize", () => { layOut(); show(shown); });
  load(0);
})();
