// Temperatures of the probes over time, and what is read of them under the pointer.

import { fitted, ink, tick } from "./bar.js";

/** Colours of the probes, on dark and on light. */
const COLOURS = {
  dark: ["#ff8f6b", "#6bc7ff", "#f2d45c", "#9be08a", "#d69bff", "#ff9ecb", "#7fe0d4", "#c9c9c9"],
  light: ["#b23a14", "#0a66a8", "#8a6800", "#2c7a1e", "#7a32b4", "#b01d6a", "#0b7468", "#555555"],
};

export function colourOf(number) {
  const all = COLOURS[window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"];
  return all[number % all.length];
}

/** Space beside the curves [CSS px]. */
const [LEFT, RIGHT] = [38, 6];

export class Curves {
  constructor(canvas) {
    this.canvas = canvas;
    this.list = [];
    /** Numbers of the probes that are not shown. */
    this.hidden = new Set();
    /** The time that is read [s]. */
    this.cursor = null;
  }

  take(curves) {
    this.list = curves.map(({ probe, points }) => ({ probe, points: new Map(points), shown: !this.hidden.has(probe.id) }));
  }

  /** Shows or hides a curve and the mark of its probe. */
  show(id, shown) {
    if (shown) this.hidden.delete(id);
    else this.hidden.add(id);
    for (const curve of this.list) curve.shown = !this.hidden.has(curve.probe.id);
  }

  /** Times of the points that are shown. */
  times() {
    return [...new Set(this.list.flatMap(({ points, shown }) => (shown ? [...points.keys()] : [])))].sort((a, b) => a - b);
  }

  /** Reads the time that is nearest to a place on the screen. */
  point(clientX, hello) {
    const { left, width } = this.canvas.getBoundingClientRect();
    const time = ((clientX - left - LEFT) / (width - LEFT - RIGHT)) * hello.steps * hello.step;
    const nearest = (best, one) => (Math.abs(one - time) < Math.abs(best - time) ? one : best);
    this.cursor = this.times().reduce(nearest, Infinity);
    if (!Number.isFinite(this.cursor)) this.cursor = null;
  }

  /** Moves the time that is read by some points, from the present one at first. */
  move(by, present) {
    const times = this.times();
    if (times.length === 0) return;
    const at = times.findIndex((time) => time >= (this.cursor ?? present));
    const next = at < 0 ? times.length - 1 : at + by;
    this.cursor = times[Math.min(Math.max(next, 0), times.length - 1)];
  }

  /** The temperatures at the time that is read, in words. Empty without one. */
  told() {
    if (this.cursor === null) return "";
    const seen = this.list.filter(({ points, shown }) => shown && points.has(this.cursor));
    return `${this.cursor.toFixed(0)} s: ${seen.map(({ probe, points }) => `${probe.name} ${points.get(this.cursor).toFixed(2)} K`).join(", ")}`;
  }

  /** Adds the temperatures of an image's time. */
  add({ time, probes, probe_temperatures: values }) {
    if (!values) return;
    for (const { probe, points } of this.list) {
      const place = probes.indexOf(probe.id);
      if (place >= 0) points.set(time, values[place]);
    }
  }

  draw(hello, header) {
    const [context, width, height] = fitted(this.canvas);
    const [left, top, right, bottom] = [LEFT, 20, width - RIGHT, height - 20];
    const end = hello.steps * hello.step;
    const shown = this.list.filter((curve) => curve.shown);
    const all = shown.flatMap(({ points }) => [...points.values()]);
    let [low, high] = [250, 310];
    if (all.length) [low, high] = all.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
    const margin = Math.max(0.06 * (high - low), 1);
    [low, high] = [low - margin, high + margin];
    const x = (time) => left + ((right - left) * time) / end;
    const y = (value) => bottom - ((bottom - top) * (value - low)) / (high - low);
    for (const [name, colour] of [["penumbra", "--half"], ["umbra", "--half"]]) {
      context.fillStyle = ink(colour);
      for (const [from, to] of hello[name]) context.fillRect(x(from), top, Math.max(x(to) - x(from), 1), bottom - top);
    }
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = ink("--faint");
    context.strokeStyle = ink("--line");
    context.lineWidth = 1;
    context.textBaseline = "middle";
    context.textAlign = "right";
    const step = tick(high - low, 5);
    for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
      context.beginPath();
      context.moveTo(left, y(value));
      context.lineTo(right, y(value));
      context.stroke();
      context.fillText(`${Number(value.toPrecision(6))}`, left - 5, y(value));
    }
    context.textAlign = "center";
    const minutes = tick(end / 60, 5);
    for (let minute = 0; minute * 60 <= end; minute += minutes) {
      const at = Math.min(Math.max(x(minute * 60), left + 4), right - 14);
      context.fillText(`${Number(minute.toPrecision(4))}`, at, bottom + 11);
    }
    context.textAlign = "left";
    context.fillText("K", 2, 7);
    context.fillText("min", 2, bottom + 11);
    for (const { probe, points } of shown) {
      context.strokeStyle = colourOf(probe.id);
      context.lineWidth = 1.8;
      context.beginPath();
      const sorted = [...points].sort((a, b) => a[0] - b[0]);
      sorted.forEach(([time, value], i) => (i ? context.lineTo(x(time), y(value)) : context.moveTo(x(time), y(value))));
      context.stroke();
      for (const time of [header.time, this.cursor]) {
        if (!points.has(time)) continue;
        context.fillStyle = colourOf(probe.id);
        context.beginPath();
        context.arc(x(time), y(points.get(time)), 3.5, 0, 7);
        context.fill();
      }
    }
    context.strokeStyle = ink("--accent");
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x(header.time), top);
    context.lineTo(x(header.time), bottom);
    context.stroke();
    if (this.cursor !== null) {
      context.strokeStyle = ink("--faint");
      context.setLineDash([3, 3]);
      context.beginPath();
      context.moveTo(x(this.cursor), top);
      context.lineTo(x(this.cursor), bottom);
      context.stroke();
      context.setLineDash([]);
    }
    const told = shown.map(({ probe, points }) => `${probe.name} ${points.get(header.time)?.toFixed(2) ?? "unknown"} K`);
    this.canvas.setAttribute("aria-label", `Temperatures of the probes over time. Arrow keys read them, Enter goes to the time that is read. Now: ${told.join(", ") || "no probes"}`);
  }
}
