// Lists beside the image: probes, materials, joints, device times, and the error against f64.

import { colourOf } from "./curves.js";

const by = (id) => document.getElementById(id);

function element(tag, text, name) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (name) made.className = name;
  return made;
}

function swatch(colour) {
  const made = element("span", "", "swatch");
  made.style.background = colour;
  return made;
}

/** Names of the colours of an image of materials or of causes. */
export function showLegend(title, entries) {
  by("legend").setAttribute("aria-label", title);
  by("legend").replaceChildren(...entries.map(({ name, colour, emissivity }) => {
    const item = element("li");
    item.append(swatch(`rgb(${colour})`), element("span", name, "name"));
    item.firstChild.nextSibling.title = name;
    if (emissivity !== undefined) item.append(element("span", `\u03b5 ${emissivity}`, "hint"));
    return item;
  }));
}

/** Tells how far the runs of the uncertainty are, and what is known of it. */
export function showUncertainty({ failed, run, step, causes, every }) {
  const out = by("uncertainty");
  out.hidden = false;
  if (run) out.dataset.run = run;
  if (failed) out.textContent = `No uncertainty: ${failed}.`;
  else if (!causes) out.textContent = `Surface temperatures until the runs of the uncertainty are done: run ${out.dataset.run}, step ${step}.`;
  else out.textContent = `One standard deviation by the ranges of ${causes.length} parameters${every > 1 ? `, linear between every ${every}th step` : ""}.`;
}

/** `change` is told to show or hide a curve. */
export function showProbes(curves, header, send, change) {
  by("no-probes").hidden = curves.length > 0;
  const list = by("probes");
  const ids = curves.map(({ probe }) => probe.id).join();
  if (list.dataset.ids !== ids) {
    list.dataset.ids = ids;
    list.replaceChildren(...curves.map(({ probe, shown }) => {
      const item = element("li");
      const remove = element("button", "\u00d7");
      remove.type = "button";
      remove.setAttribute("aria-label", `Remove the probe ${probe.name}`);
      remove.addEventListener("click", () => send({ do: "remove", probe: probe.id }));
      const name = element("span", probe.name, "name");
      name.title = `${probe.name}, ${probe.material}, node ${probe.node}`;
      const show = element("input");
      show.type = "checkbox";
      show.checked = shown;
      show.setAttribute("aria-label", `Show the probe ${probe.name}`);
      show.addEventListener("change", () => change(probe.id, show.checked));
      item.append(show, swatch(colourOf(probe.id)), name, element("span", "", "value"), remove, element("span", "", "place hint"));
      return item;
    }));
  }
  list.querySelectorAll(".value").forEach((value, i) => {
    const present = curves[i].points.get(header.time);
    value.textContent = present === undefined ? "" : `${present.toFixed(2)} K`;
  });
  list.querySelectorAll(".place").forEach((text, i) => {
    const place = header.probe_places[header.probes.indexOf(curves[i].probe.id)];
    const seen = !place?.pixel ? "behind the camera" : place.hidden ? "hidden" : "";
    text.textContent = place ? `${place.position.map((value) => value.toFixed(2)).join(", ")} m${seen && `, ${seen}`}` : "";
  });
}

export function showJoints(joints, positions) {
  by("joints-section").hidden = joints.length === 0;
  const rows = by("joints");
  while (rows.children.length < joints.length) {
    const row = element("tr");
    row.append(element("td", joints[rows.children.length].name), element("td"));
    rows.append(row);
  }
  while (rows.children.length > joints.length) rows.lastChild.remove();
  positions.forEach((position, i) => {
    rows.children[i].lastChild.textContent = `${position.toFixed(joints[i].unit === "m" ? 3 : 1)} ${joints[i].unit}`;
  });
}

export function showPasses(passes) {
  by("no-passes").hidden = passes.length > 0;
  const longest = Math.max(...passes.map(([, ms]) => ms), 1e-6);
  const sorted = [...passes].sort((a, b) => b[1] - a[1]);
  by("passes").replaceChildren(...sorted.map(([name, ms]) => {
    const row = element("tr");
    const bar = element("meter");
    bar.max = longest;
    bar.value = ms;
    bar.setAttribute("aria-label", `Share of ${name}`);
    const cell = element("td");
    cell.append(bar);
    const first = element("td", name);
    first.title = name;
    row.append(first, cell, element("td", `${ms.toFixed(ms < 1 ? 3 : 2)} ms`));
    return row;
  }));
}

/** Tells how far the warm-up is. */
export function showWarmUp({ done, steps, doing }) {
  by("warm-up").hidden = false;
  const bar = by("warm-up-bar");
  if (steps) [bar.max, bar.value] = [steps, done];
  else bar.removeAttribute("value");
  const work = doing.filter((text) => text !== "warm-up").join(", ");
  by("warm-up-text").textContent = [steps ? `Warm-up: step ${done} of ${steps}` : "Warm-up", work].filter(Boolean).join(". ");
}

/** Tells the values of what is chosen among the objects. */
export function showChosen(seen, unit) {
  by("chosen").textContent = seen
    ? `${seen.low.toFixed(2)} to ${seen.high.toFixed(2)} ${unit}, mean ${seen.mean.toFixed(2)} ${unit}, in ${seen.count} pixels`
    : "The image does not show it.";
}

/** Tells the state of the comparison with f64; returns it in a few words. */
export function showAccuracy({ result, failed, step, steps }) {
  const done = result || failed;
  by("compare").disabled = !done;
  if (failed) {
    by("accuracy").textContent = `No figure: ${failed}.`;
    return "not compared";
  }
  if (!done) {
    by("accuracy").textContent = step === 0 ? "Warm-up of the run." : `Step ${step} of ${steps}.`;
    return "comparing";
  }
  const { max_k: max, rms_k: rms, nodes, of_nodes: all, steps: compared, worst_node: worst } = result;
  by("accuracy").textContent =
    `At most ${max.toExponential(1)} K, rms ${rms.toExponential(1)} K: ${nodes} of ${all} nodes in ${compared} steps. Greatest at ${worst}.`;
  return `error against f64 at most ${max.toExponential(1)} K`;
}
