// The camera that turns about the craft: its angles, and what the pointer and the keys do with them.

import { fitted, ink as colour } from "./bar.js";

const add = (a, b, s = 1) => a.map((value, i) => value + s * b[i]);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => a.map((value) => value * s);
const unit = (a) => scaled(a, 1 / Math.max(Math.hypot(...a), 1e-30));

/** Largest angle above or below the plane about which the camera turns [rad]. */
const STEEPEST = 1.55;

export class Orbit {
  /** `look` takes position, target and up. */
  constructor({ middle, radius, up, focal, size }, look) {
    Object.assign(this, { middle, radius, up, look });
    this.pixelAngle = 1 / focal[1];
    this.height = size[1];
    const across = Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
    this.east = unit(add(across, up, -dot(across, up)));
    this.north = cross(up, this.east);
    this.known = false;
  }

  /** Takes the angles of the camera of an image, unless the page has its own. */
  follow(header) {
    if (this.known && !header.scene_camera) return;
    const back = add(header.position, this.middle, -1);
    this.distance = Math.hypot(...back);
    // The point on the line of sight that is nearest to the middle.
    const forward = header.camera_from_body[2];
    this.target = add(header.position, forward, Math.max(-dot(back, forward), 0.1 * this.radius));
    const from = add(header.position, this.target, -1);
    this.distance = Math.max(Math.hypot(...from), 1e-6);
    this.elevation = Math.asin(Math.max(-1, Math.min(1, dot(from, this.up) / this.distance)));
    this.elevation = Math.max(-STEEPEST, Math.min(STEEPEST, this.elevation));
    this.azimuth = Math.atan2(dot(from, this.north), dot(from, this.east));
    this.known = true;
  }

  place() {
    const flat = add(scaled(this.east, Math.cos(this.azimuth)), this.north, Math.sin(this.azimuth));
    return add(scaled(flat, Math.cos(this.elevation)), this.up, Math.sin(this.elevation));
  }

  send() {
    const position = add(this.target, this.place(), this.distance);
    this.look({ do: "look", position, target: this.target, up: this.up });
  }

  turn(right, down) {
    if (!this.known) return;
    this.azimuth -= right;
    this.elevation = Math.max(-STEEPEST, Math.min(STEEPEST, this.elevation + down));
    this.send();
  }

  zoom(factor) {
    if (!this.known) return;
    this.distance = Math.max(0.02 * this.radius, Math.min(1000 * this.radius, this.distance * factor));
    this.send();
  }

  /** Moves the point in the middle by pixels of the image. */
  shift(right, down) {
    if (!this.known) return;
    const back = this.place();
    const east = unit(cross(this.up, back));
    const metres = this.distance * this.pixelAngle;
    this.target = add(add(this.target, east, -right * metres), cross(back, east), down * metres);
    this.send();
  }
}

/** Lets the pointer, or two fingers, turn, shift and zoom. `click` is told of a press without a drag. */
export function listen(canvas, orbit, click) {
  const held = new Map();
  let moved = 0;
  /** Middle of the pointers, and the distance of two. */
  const grip = () => {
    const all = [...held.values()];
    const middle = [0, 1].map((i) => all.reduce((sum, at) => sum + at[i], 0) / all.length);
    return { middle, apart: all.length === 2 ? Math.hypot(all[0][0] - all[1][0], all[0][1] - all[1][1]) : 0 };
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (held.size === 0) moved = 0;
    if (held.size < 2) held.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held.has(event.pointerId)) return;
    const last = held.get(event.pointerId);
    moved += Math.abs(event.clientX - last[0]) + Math.abs(event.clientY - last[1]);
    const before = grip();
    held.set(event.pointerId, [event.clientX, event.clientY]);
    if (moved < 4) return;
    const after = grip();
    const [dx, dy] = [0, 1].map((i) => after.middle[i] - before.middle[i]);
    const pixels = orbit()?.height / canvas.getBoundingClientRect().height;
    if (before.apart > 0 && after.apart > 0) orbit()?.zoom(before.apart / after.apart);
    if (held.size === 2 || event.shiftKey || event.buttons === 4) orbit()?.shift(dx * pixels, dy * pixels);
    else orbit()?.turn(dx * 0.008, dy * 0.008);
  });
  const release = (event) => {
    const alone = held.delete(event.pointerId) && held.size === 0;
    if (event.type === "pointerup" && alone && moved < 4) click(event);
    // One finger that stays does not turn the craft at once.
    moved += held.size;
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    orbit()?.zoom(Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY * 0.0015))));
  }, { passive: false });
}

/** Draws where Sun, planet and the axes of the body point. */
export function drawCompass(canvas, header) {
  const [context, size] = fitted(canvas);
  const middle = size / 2;
  context.globalAlpha = 0.82;
  context.fillStyle = colour("--panel");
  context.beginPath();
  context.arc(middle, middle, middle - 1, 0, 7);
  context.fill();
  context.font = "600 12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
  const sun = dark ? "#ffd257" : "#9a6a00";
  const arrows = [
    { at: [1, 0, 0], text: "X", ink: colour("--faint"), long: 0.5 },
    { at: [0, 1, 0], text: "Y", ink: colour("--faint"), long: 0.5 },
    { at: [0, 0, 1], text: "Z", ink: colour("--faint"), long: 0.5 },
    { at: header.planet, text: "Planet", ink: dark ? "#7fb2ff" : "#1f5fbf", long: 0.8 },
    { at: header.sun, text: header.lit <= 0 ? "Sun, hidden" : header.lit < 1 ? "Sun, partly" : "Sun", ink: sun, long: 0.8 },
  ].map((arrow) => ({ ...arrow, seen: header.camera_from_body.map((row) => dot(row, arrow.at)) }));
  arrows.sort((a, b) => b.seen[2] - a.seen[2]);
  for (const { seen, text, ink, long } of arrows) {
    const [x, y] = [0, 1].map((i) => middle + (middle - 19) * long * seen[i]);
    // What points away from the viewer is fainter.
    context.globalAlpha = seen[2] > 0 ? 0.55 : 1;
    context.strokeStyle = context.fillStyle = ink;
    context.lineWidth = long > 0.6 ? 2.5 : 1.5;
    context.setLineDash(seen[2] > 0.2 ? [4, 3] : []);
    context.beginPath();
    context.moveTo(middle, middle);
    context.lineTo(x, y);
    context.stroke();
    context.setLineDash([]);
    const width = context.measureText(text).width / 2;
    const place = [0, 1].map((i) => middle + ((middle - 19) * long + 10 + i) * seen[i]);
    context.fillText(text, Math.max(width + 4, Math.min(size - width - 4, place[0])), place[1]);
  }
  context.globalAlpha = 1;
  const words = ["right", "down", "away"];
  const told = ([x, y, z]) => `${x.toFixed(2)} ${words[0]}, ${y.toFixed(2)} ${words[1]}, ${z.toFixed(2)} ${words[2]}`;
  canvas.setAttribute("aria-label", `Directions in the image. ${arrows.map((a) => `${a.text}: ${told(a.seen)}`).join(". ")}`);
}
