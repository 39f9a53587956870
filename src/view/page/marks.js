// Marks of the probes on the craft.

import { fitted, ink } from "./bar.js";
import { colourOf } from "./curves.js";

/** Draws a mark and a name at each probe that lies in the image. A hidden one is hollow. */
export function drawMarks(canvas, picture, header, curves) {
  const [context] = fitted(canvas);
  const { zoom, left, top } = picture.placement();
  context.font = "600 12px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.lineJoin = "round";
  const taken = [];
  const told = [];
  for (const { probe, shown } of curves) {
    const place = header.probe_places[header.probes.indexOf(probe.id)];
    if (!place?.pixel || !shown) continue;
    const [x, y] = [left + zoom * place.pixel[0], top + zoom * place.pixel[1]];
    if (x < left || y < top || x > left + zoom * header.width || y > top + zoom * header.height) continue;
    told.push(`${probe.name} at ${place.pixel.map((at) => at.toFixed(1)).join(", ")}${place.hidden ? ", hidden" : ""}`);
    context.beginPath();
    context.arc(x, y, 5, 0, 7);
    context.lineWidth = 4.5;
    context.strokeStyle = ink("--panel");
    context.stroke();
    context.lineWidth = 2;
    context.strokeStyle = context.fillStyle = colourOf(probe.id);
    context.stroke();
    if (!place.hidden) context.fill();
    // A name that would lie on another one is left out: the list has it.
    const width = context.measureText(probe.name).width;
    const box = [x + 9, y - 8, x + 9 + width, y + 8];
    if (taken.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3])) continue;
    taken.push(box);
    context.lineWidth = 4;
    context.strokeStyle = ink("--panel");
    context.strokeText(probe.name, x + 9, y);
    context.fillStyle = ink("--ink");
    context.fillText(probe.name, x + 9, y);
  }
  canvas.dataset.marks = told.join("; ");
}
