// Joins the page: what the program tells goes to the canvas and the lists, and what the user does goes to the program.

import { drawBar } from "./bar.js";
import { Orbit, drawCompass, listen } from "./camera.js";
import { Curves } from "./curves.js";
import { connect } from "./link.js";
import { drawMarks } from "./marks.js";
import { Objects } from "./objects.js";
import { showAccuracy, showChosen, showJoints, showLegend, showPasses, showProbes, showUncertainty, showWarmUp } from "./panels.js";
import { Picture } from "./picture.js";
import { saveCamera, savePicture, saveSeries } from "./save.js";
import { Timeline } from "./timeline.js";

const by = (id) => document.getElementById(id);
const picture = new Picture(by("picture"));
const curves = new Curves(by("curves"));
const objects = new Objects(by("objects"), later);
let hello = null;
/** The last range of the colours whose ends are in order. */
let inOrder = [250, 310];
let orbit = null;
let pointer = null;
let accuracy = "not compared with f64";
let arrivals = [];
let waiting = false;
let hideProblem = 0;
/** The names of the uncertainty's causes. `null` before its runs are done. */
let known = null;
let isAsked = false;

const send = connect({
  state(open) {
    by("link").textContent = open ? "connected" : "no connection; trying again";
    by("link").classList.toggle("lost", !open);
  },
  warm_up: showWarmUp,
  hello: begin,
  curves({ curves: list }) {
    curves.take(list);
    later();
  },
  accuracy(message) {
    accuracy = showAccuracy(message);
    later();
  },
  sigma(message) {
    showUncertainty(message);
    if (message.failed) isAsked = false;
    if (!message.causes) return;
    known = picture.names.cause = message.causes;
    choose();
  },
  problem({ message }) {
    by("problem").textContent = message;
    by("problem").hidden = false;
    clearTimeout(hideProblem);
    hideProblem = setTimeout(() => { by("problem").hidden = true; }, 6000);
  },
  image(image) {
    picture.image = image;
    arrivals = [...arrivals.filter((at) => at > performance.now() - 2000), performance.now()];
    orbit?.follow(image.header);
    curves.add(image.header);
    timeline.note(image.header);
    later();
  },
});
const timeline = new Timeline(send);

function begin(message) {
  hello = message;
  by("warm-up").hidden = true;
  document.title = `${hello.scene} \u2013 Isotherm`;
  by("scene").textContent = hello.scene;
  const band = hello.band_um.map((end) => Number(end.toPrecision(4))).join(" to ");
  by("about").textContent =
    `${hello.nodes.toLocaleString("en")} nodes, ${hello.triangles.toLocaleString("en")} triangles, ${band} \u00b5m, ${hello.device}`;
  orbit = new Orbit(hello, send);
  picture.names.material = hello.materials;
  picture.gains = hello.causes;
  [known, isAsked] = [null, false];
  by("uncertainty").hidden = true;
  timeline.take(hello);
  objects.take(hello);
  const chosen = by("map").value;
  by("map").replaceChildren(...hello.maps.map(({ name }) => new Option(name, name)));
  if (chosen) by("map").value = chosen;
  by("quantity").querySelector("[value=counts]").disabled = !hello.sensor;
  by("quantity").querySelector("[value=error]").hidden = !hello.error;
  for (const name of ["sigma", "cause"]) by("quantity").querySelector(`[value=${name}]`).hidden = !hello.uncertainty;
  const before = by("quantity").value;
  by("causes").replaceChildren(...hello.causes.map((name) => new Option(CAUSES[name] ?? name, name)));
  by("causes").hidden = hello.causes.length === 0;
  by("quantity").value = before;
  if (by("quantity").value !== before) by("quantity").value = "temperature";
  if (by("quantity").selectedOptions[0].hidden) by("quantity").value = "temperature";
  by("home").disabled = !hello.scene_camera;
  by("home").textContent = hello.camera_path ? "Scene's camera path" : "Scene's camera";
  if (hello.colour_range && by("lower").value === "") [by("lower").value, by("upper").value] = hello.colour_range;
  else if (by("lower").value === "") by("auto").checked = true;
  choose();
}

/** What is shown: temperatures until the chosen uncertainty is in the image. */
function shown() {
  const quantity = by("quantity").value;
  const isThere = !["sigma", "cause"].includes(quantity) || (known && picture.image?.planes.sigma);
  return isThere ? quantity : "temperature";
}

/** Tells the program which numbers are shown. */
function choose() {
  const quantity = by("quantity").value;
  if (["sigma", "cause"].includes(quantity) && !known && !isAsked) {
    isAsked = true;
    send({ do: "sigma" });
  }
  const isName = quantity in picture.names && (quantity !== "cause" || known);
  if (isName && quantity === "material") showLegend("Materials", hello.materials);
  else if (isName) showLegend("Causes", [...known, { name: "no parameter", colour: picture.none }]);
  by("legend").hidden = !isName;
  for (const id of ["bar", "range", "of-map"]) by(id).hidden = isName;
  const isCause = hello?.causes.includes(quantity);
  by("unit").textContent = unit();
  if (quantity === "counts" || ["error", "sigma"].includes(quantity) || isCause) by("auto").checked = true;
  // All others come with every image.
  send({ do: "show", quantity: ["apparent", "counts"].includes(quantity) ? quantity : "temperature" });
  later();
}

/** The unit of what is shown. */
function unit() {
  const quantity = by("quantity").value;
  return quantity === "counts" ? "" : hello?.causes.includes(quantity) ? "W/m\u00b2" : "K";
}

/** The range of the colours. Ends that are not in order change nothing, and the page says so. */
function range() {
  const ends = ["lower", "upper"].map((id) => by(id).valueAsNumber);
  const isInOrder = ends[0] < ends[1];
  if (isInOrder) inOrder = ends;
  for (const id of ["lower", "upper"]) by(id).setAttribute("aria-invalid", String(!isInOrder));
  by("out-of-order").hidden = isInOrder;
  if (!isInOrder) by("out-of-order").textContent = `The first end must be below the second one: the colours stay at ${inOrder.join(" to ")} ${unit()}.`;
  return inOrder;
}

/** The causes of a budget in words. */
const CAUSES = {
  Q_sun: "Sun", Q_albedo: "Albedo", Q_planet: "Planet's infrared", Q_exchange: "Other surfaces",
  Q_conduction: "Conduction", Q_heater: "Heaters", Q_stored: "Storage", Q_emitted: "Emission",
};

/** Bars of the gains of a pixel [W/m2], losses to the left and gains to the right of the middle. */
function budgetChart(gains) {
  const chart = document.createElement("div");
  chart.className = "budget";
  const most = Math.max(...gains.map(([, gain]) => Math.abs(gain)), 1e-3);
  for (const [name, gain] of gains) {
    const [label, track, bar, number] = ["span", "div", "div", "span"].map((tag) => document.createElement(tag));
    label.textContent = CAUSES[name] ?? name;
    number.textContent = `${gain.toFixed(1)} W/m\u00b2`;
    const share = (50 * Math.abs(gain)) / most;
    bar.style.width = `${share}%`;
    bar.style.marginLeft = `${gain < 0 ? 50 - share : 50}%`;
    bar.className = gain < 0 ? "loss" : "gain";
    track.append(bar);
    chart.append(label, track, number);
  }
  return chart;
}

const map = () => hello.maps.find(({ name }) => name === by("map").value) ?? hello.maps[0];

/** The multiples of a number round a range, without the rounding of their products. */
function ends([low, high], round) {
  const lower = Math.floor(low / round) * round;
  return [lower, Math.max(Math.ceil(high / round) * round, lower + round)].map((end) => Number(end.toPrecision(9)));
}

/** A tenth of the power of ten of the largest error. */
const errorStep = (range) => 10 ** (Math.floor(Math.log10(Math.max(range?.[1] ?? 1, 1e-3))) - 1);

/** Draws with the next frame of the browser. */
function later() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    if (hello && picture.image) draw();
  });
}

function draw() {
  const { header } = picture.image;
  const quantity = shown();
  if (by("auto").checked && !(quantity in picture.names)) {
    const range = picture.range(quantity);
    const round = ["error", "sigma"].includes(quantity) ? errorStep(range) : quantity === "counts" ? 1 : 5;
    if (range) {
      const [lower, upper] = ends(range, round);
      if (document.activeElement !== by("lower")) by("lower").value = lower;
      if (document.activeElement !== by("upper")) by("upper").value = upper;
    }
  }
  picture.stands = objects.any ? (part, material) => objects.has(part, material) : null;
  picture.draw(quantity, map(), range());
  by("chosen").hidden = !objects.any;
  if (objects.any) showChosen(picture.statistics(quantity), unit());
  timeline.show(header);
  drawCompass(by("compass"), header);
  curves.draw(hello, header);
  by("curve-read").textContent = curves.told();
  showProbes(curves.list, header, send, (id, shown) => {
    curves.show(id, shown);
    later();
  });
  drawMarks(by("marks"), picture, header, curves.list);
  by("home").setAttribute("aria-pressed", String(header.scene_camera));
  by("off-path").hidden = !header.off_path;
  showJoints(hello.joints, header.joints);
  showPasses(header.passes);
  read();
  const rate = arrivals.length > 1 ? ((arrivals.length - 1) / (arrivals.at(-1) - arrivals[0])) * 1000 : 0;
  const moving = arrivals.at(-1) > performance.now() - 1000 && arrivals.length > 2 ? `${rate.toFixed(1)} images/s \u00b7 ` : "";
  const device = header.passes.reduce((sum, [, ms]) => sum + ms, 0);
  const measured = header.passes.length ? ` \u00b7 passes ${device.toFixed(1)} ms on the device` : "";
  const packing = by("developer").checked ? ` \u00b7 packing ${header.pack_ms.toFixed(1)} ms${measured}` : "";
  by("speed").textContent =
    `${moving}step ${header.step_ms.toFixed(1)} ms \u00b7 image ${header.image_ms.toFixed(1)} ms${packing} \u00b7 ${accuracy}`;
}

/** Shows what lies under the pointer, or in the middle where the keyboard has the image. */
function read() {
  const at = place();
  const found = at && picture.at(at);
  const out = by("readout");
  out.replaceChildren();
  const quantity = shown();
  const isSeen = found && (found.part !== 0 || ["apparent", "counts"].includes(quantity)) && !(quantity in picture.names);
  drawBar(by("bar"), map(), inOrder, unit(), isSeen ? picture.value(quantity, found) : undefined);
  if (!found) return;
  const line = (tag, text) => {
    const made = document.createElement(tag);
    made.textContent = text;
    out.append(made);
  };
  if (found.part === 0) line("strong", "space");
  else line("strong", `${found.temperature.toFixed(2)} K`);
  if (found.part !== 0 && found.error !== undefined) line("span", `\u00b1 ${found.error.toPrecision(3)} K by the computation, one standard deviation`);
  if (found.part !== 0 && found.sigma !== undefined) {
    line("span", `\u00b1 ${found.sigma.toPrecision(3)} K by the ranges of parameters${found.cause ? `, most by ${found.cause}` : ""}`);
  }
  if (found.apparent !== undefined) line("span", `apparent ${found.apparent.toFixed(2)} K`);
  if (found.counts !== undefined) line("span", `digital number ${found.counts}`);
  if (found.part !== 0) {
    const { name, emissivity } = hello.materials[found.material - 1];
    line("span", hello.parts[found.part - 1]);
    line("span", `${name}, emissivity ${emissivity}`);
    if (found.gains.length) out.append(budgetChart(found.gains));
  }
  line("span", `pixel ${found.x}, ${found.y}`);
}

function place() {
  if (pointer) return picture.pixelAt(...pointer);
  const { width, height } = picture.canvas;
  return document.activeElement === picture.canvas ? { x: width >> 1, y: height >> 1 } : null;
}

function probe(at) {
  if (at) send({ do: "probe", ...at });
}

listen(picture.canvas, () => orbit, (event) => probe(picture.pixelAt(event.clientX, event.clientY)));
picture.canvas.addEventListener("pointermove", (event) => {
  pointer = [event.clientX, event.clientY];
  if (hello && picture.image) read();
});
picture.canvas.addEventListener("pointerleave", (event) => {
  // A finger that was lifted leaves what it has touched.
  if (event.pointerType !== "touch") pointer = null;
  if (hello && picture.image) read();
});
picture.canvas.addEventListener("focus", later);
picture.canvas.addEventListener("blur", later);
for (const id of ["quantity", "map"]) by(id).addEventListener("change", choose);
by("auto").addEventListener("change", later);
for (const id of ["lower", "upper"]) {
  by(id).addEventListener("input", () => {
    by("auto").checked = false;
    later();
  });
}
const onCurves = (read) => {
  if (!hello || !picture.image) return;
  read();
  later();
};
const there = () => { if (curves.cursor !== null) send({ do: "seek", time: curves.cursor }); };
by("curves").addEventListener("pointermove", (event) => onCurves(() => curves.point(event.clientX, hello)));
by("curves").addEventListener("click", (event) => onCurves(() => {
  curves.point(event.clientX, hello);
  there();
}));
for (const name of ["pointerleave", "blur"]) {
  by("curves").addEventListener(name, () => onCurves(() => { if (document.activeElement !== by("curves")) curves.cursor = null; }));
}
by("curves").addEventListener("keydown", (event) => {
  const moves = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -Infinity, End: Infinity };
  if (event.key === "Enter") there();
  else if (event.key in moves) onCurves(() => curves.move(moves[event.key], picture.image.header.time));
  else return;
  event.preventDefault();
  event.stopPropagation();
});
by("developer").addEventListener("change", () => {
  by("passes-section").hidden = !by("developer").checked;
  later();
});
by("nearer").addEventListener("click", () => orbit?.zoom(0.8));
by("farther").addEventListener("click", () => orbit?.zoom(1 / 0.8));
by("save-picture").addEventListener("click", () => {
  if (!picture.image) return;
  const quantity = by("quantity");
  const isName = shown() in picture.names;
  const what = shown() === quantity.value ? quantity.selectedOptions[0].text : "Surface temperature";
  const label = [what, isName ? "" : unit()].filter(Boolean).join(", ");
  savePicture(hello, picture.image.header, picture.canvas, label, isName ? null : map(), inOrder);
});
by("save-series").addEventListener("click", () => { if (picture.image) saveSeries(hello, picture.image.header, curves.list); });
by("save-camera").addEventListener("click", () => { if (picture.image) saveCamera(hello, picture.image.header); });
by("home").addEventListener("click", () => send({ do: "scene_camera" }));
by("compare").addEventListener("click", () => send({ do: "compare" }));
window.addEventListener("resize", later);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  by("probes").dataset.ids = "";
  later();
});

const KEYS = {
  " ": () => timeline.toggle(),
  ",": () => send({ do: "step", by: -1 }),
  ".": () => send({ do: "step", by: 1 }),
  "ArrowLeft": () => orbit?.turn(-0.08, 0),
  "ArrowRight": () => orbit?.turn(0.08, 0),
  "ArrowUp": () => orbit?.turn(0, -0.08),
  "ArrowDown": () => orbit?.turn(0, 0.08),
  "+": () => orbit?.zoom(0.9),
  "=": () => orbit?.zoom(0.9),
  "-": () => orbit?.zoom(1 / 0.9),
  "c": () => send({ do: "scene_camera" }),
};
document.addEventListener("keydown", (event) => {
  const { tagName, type } = event.target;
  const ofSlider = type === "range" && event.key.startsWith("Arrow");
  const ofForm = tagName === "SELECT" || (tagName === "INPUT" && type !== "range");
  const ofButton = tagName === "BUTTON" && [" ", "Enter"].includes(event.key);
  if (ofSlider || ofForm || ofButton || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "Enter" && event.target === picture.canvas) probe(place());
  else if (KEYS[event.key]) KEYS[event.key]();
  else return;
  event.preventDefault();
});
