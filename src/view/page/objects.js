// The tree of parts and materials. What is chosen there stands out in the image.

const NOTHING = { part: null, material: null };

function element(tag, text, name) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (name) made.className = name;
  return made;
}

export class Objects {
  /** `changed` is called when another object is chosen. */
  constructor(tree, changed) {
    Object.assign(this, { tree, changed, chosen: NOTHING });
    tree.addEventListener("click", (event) => {
      const item = event.target.closest("[role=treeitem]");
      if (item) this.use(item);
    });
    tree.addEventListener("keydown", (event) => this.key(event));
  }

  /** Builds the tree: parts with their materials, and materials. Labels count from 1, as in an image. */
  take({ parts, materials, objects }) {
    const within = new Map();
    for (const [part, material] of objects) within.set(part, [...(within.get(part) ?? []), material]);
    const material = (number, part) => this.item(materials[number].name, { part, material: number + 1 }, materials[number].colour);
    const part = ([number, all]) => {
      const leaf = all.length === 1;
      const item = this.item(parts[number], { part: number + 1, material: null }, leaf ? materials[all[0]].colour : undefined);
      if (leaf) item.firstChild.append(element("span", materials[all[0]].name, "hint"));
      else this.nest(item, all.map((one) => material(one, number + 1)));
      return item;
    };
    const used = [...new Set(objects.map(([, number]) => number))].sort((a, b) => a - b);
    const roots = [["Parts", [...within].map(part)], ["Materials", used.map((number) => material(number, null))]];
    this.tree.replaceChildren(...roots.map(([name, items]) => {
      const root = this.item(`${name} (${items.length})`, null);
      this.nest(root, items);
      return root;
    }));
    this.tree.firstChild.tabIndex = 0;
    this.choose(NOTHING);
  }

  item(name, object, colour) {
    const item = element("li");
    item.setAttribute("role", "treeitem");
    item.tabIndex = -1;
    if (object) {
      item.setAttribute("aria-selected", "false");
      item.object = object;
    }
    const row = element("div", undefined, "item");
    if (colour) {
      const swatch = element("span", "", "swatch");
      swatch.style.background = `rgb(${colour})`;
      row.append(swatch);
    }
    row.append(element("span", name, "name"));
    row.title = name;
    item.append(row);
    return item;
  }

  nest(item, items) {
    const group = element("ul");
    group.setAttribute("role", "group");
    group.append(...items);
    item.setAttribute("aria-expanded", "true");
    item.append(group);
  }

  /** Chooses an object, or nothing where it was chosen already. A heading opens or closes. */
  use(item) {
    this.go(item);
    if (!item.object) this.open(item, item.getAttribute("aria-expanded") !== "true");
    else this.choose(item.getAttribute("aria-selected") === "true" ? NOTHING : item.object);
  }

  choose(object) {
    this.chosen = object;
    for (const item of this.tree.querySelectorAll("[aria-selected]")) {
      item.setAttribute("aria-selected", String(item.object === object));
    }
    this.changed();
  }

  /** Whether a pixel with these labels is chosen. Without a choice all are. */
  has(part, material) {
    const { chosen } = this;
    return (chosen.part === null || chosen.part === part) && (chosen.material === null || chosen.material === material);
  }

  get any() {
    return this.chosen !== NOTHING;
  }

  open(item, open) {
    item.setAttribute("aria-expanded", String(open));
    item.querySelector("[role=group]").hidden = !open;
  }

  /** Moves the focus, which only one item of the tree takes. */
  go(item) {
    for (const other of this.tree.querySelectorAll("[tabindex='0']")) other.tabIndex = -1;
    item.tabIndex = 0;
    item.focus();
  }

  key(event) {
    const item = event.target;
    const all = [...this.tree.querySelectorAll("[role=treeitem]")].filter((one) => !one.parentElement.closest("[hidden]"));
    const at = all.indexOf(item);
    const expanded = item.getAttribute("aria-expanded");
    const above = item.parentElement.closest("[role=treeitem]");
    const to = { ArrowDown: all[at + 1], ArrowUp: all[at - 1], Home: all[0], End: all.at(-1) }[event.key];
    if (to) this.go(to);
    else if (event.key === "ArrowRight" && expanded === "false") this.open(item, true);
    else if (event.key === "ArrowRight" && expanded === "true") this.go(all[at + 1]);
    else if (event.key === "ArrowLeft" && expanded === "true") this.open(item, false);
    else if (event.key === "ArrowLeft" && above) this.go(above);
    else if (event.key === "Enter" || event.key === " ") this.use(item);
    else if (event.key === "Escape") this.choose(NOTHING);
    else if (!event.key.startsWith("Arrow")) return;
    event.preventDefault();
    event.stopPropagation();
  }
}
