// Temperatures of the probes over time.

/** Colours of the probes, on dark and on light. */
const COLOURS = {
  dark: ["#ff8f6b", "#6bc7ff", "#f2d45c", "#9be08a", "#d69bff", "#ff9ecb", "#7fe0d4", "#c9c9c9"],
  light: ["#b23a14", "#0a66a8", "#8a6800", "#2c7a1e", "#7a32b4", "#b01d6a", "#0b7468", "#555555"],
};

export function colourOf(number) {
  const all = COLOURS[window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"];
  return all[number % all.length];
}

/** A round distance between two ticks. */
function tick(span, most) {
  const rough = span / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
}

export class Curves {
  constructor(canvas) {
    this.canvas = canvas;
    this.list = [];
  }

  take(curves) {
    this.list = curves.map(({ probe, points }) => ({ probe, points: new Map(points) }));
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
    const box = this.canvas.getBoundingClientRect();
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [box.width, box.height];
    if (this.canvas.width !== Math.round(width * ratio)) this.canvas.width = Math.round(width * ratio);
    if (this.canvas.height !== Math.round(height * ratio)) this.canvas.height = Math.round(height * ratio);
    const context = this.canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    const ink = (name) => style.getPropertyValue(name).trim();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const [left, top, right, bottom] = [38, 20, width - 6, height - 20];
    const end = hello.steps * hello.step;
    const all = this.list.flatMap(({ points }) => [...points.values()]);
    let [low, high] = [250, 310];
    if (all.length) [low, high] = [Math.min(...all), Math.max(...all)];
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
    for (const { probe, points } of this.list) {
      context.strokeStyle = colourOf(probe.id);
      context.lineWidth = 1.8;
      context.beginPath();
      const sorted = [...points].sort((a, b) => a[0] - b[0]);
      sorted.forEach(([time, value], i) => (i ? context.lineTo(x(time), y(value)) : context.moveTo(x(time), y(value))));
      context.stroke();
      const present = points.get(header.time);
      if (present !== undefined) {
        context.fillStyle = colourOf(probe.id);
        context.beginPath();
        context.arc(x(header.time), y(present), 3.5, 0, 7);
        context.fill();
      }
    }
    context.strokeStyle = ink("--accent");
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x(header.time), top);
    context.lineTo(x(header.time), bottom);
    context.stroke();
    const told = this.list.map(({ probe, points }) => `${probe.name} ${points.get(header.time)?.toFixed(2) ?? "unknown"} K`);
    this.canvas.setAttribute("aria-label", `Temperatures of the probes over time. Now: ${told.join(", ") || "no probes"}`);
  }
}
