// Files that the page makes: the picture, the curves of the probes, and the camera as a section of a scene file.

import { drawScale, ink } from "./bar.js";

/** Width below which a picture's pixels become squares of several pixels, and height of the bar below it. */
const [WIDTH, BELOW] = [640, 66];

function save(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** A name of a file that tells scene and time. */
const named = (hello, time, end) => `${hello.scene.replace(/[^\w.-]+/g, "_")}_${time.toFixed(0)}s.${end}`;

/** The image with its colour bar. `label` tells quantity and unit; a picture of materials has no bar. */
export function savePicture(hello, header, source, label, map, range) {
  const scale = Math.max(1, Math.ceil(WIDTH / header.width));
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [header.width * scale, header.height * scale + BELOW];
  const context = canvas.getContext("2d");
  context.fillStyle = ink("--panel");
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.imageSmoothingEnabled = false;
  context.drawImage(source, 0, 0, canvas.width, header.height * scale);
  const top = header.height * scale;
  if (map) drawScale(context, map, range, [12, canvas.width - 12, top + 10]);
  context.font = "12px system-ui, sans-serif";
  context.textBaseline = "bottom";
  context.textAlign = "left";
  context.fillStyle = ink("--ink");
  context.fillText(`${hello.scene}, ${header.time.toFixed(0)} s. ${label}`, 12, canvas.height - 4);
  canvas.toBlob((blob) => save(named(hello, header.time, "png"), blob), "image/png");
}

const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

/** Repeated names get a number. */
function unique(names) {
  const used = new Set();
  return names.map((name) => {
    let free = name;
    for (let i = 2; used.has(free); i += 1) free = `${name}#${i}`;
    used.add(free);
    return free;
  });
}

/** The curves as CSV with the columns of `series.csv`: `time` [s] and `probe:NAME` [K]. */
export function saveSeries(hello, header, curves) {
  const names = unique(curves.map(({ probe }) => probe.name)).map((name) => quoted(`probe:${name}`));
  const times = [...new Set(curves.flatMap(({ points }) => [...points.keys()]))].sort((a, b) => a - b);
  const rows = times.map((time) => [time, ...curves.map(({ points }) => points.get(time) ?? "")].join());
  save(named(hello, header.time, "csv"), new Blob([`${[["time", ...names].join(), ...rows].join("\n")}\n`], { type: "text/csv" }));
}

/** The camera of the image as `[camera]` of a scene file: it stands still in the body frame. */
export function saveCamera(hello, header) {
  const list = (numbers) => `[${numbers.map((value) => (Number.isInteger(value) ? value.toFixed(1) : value)).join(", ")}]`;
  const text = `# The camera of isotherm view with ${JSON.stringify(hello.scene)}, ${header.time} s after the start.\n[camera]\n${hello.camera_toml}`
    + `frame = "body"\nposition = ${list(header.position)}\nquaternion = ${list(header.quaternion)}\nnear = ${header.near}\n`;
  save(named(hello, header.time, "toml"), new Blob([text], { type: "application/toml" }));
}
