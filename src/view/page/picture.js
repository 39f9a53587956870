// The image on its canvas: numbers become colours, and a place on the canvas becomes a pixel.

const word = ([r, g, b]) => (255 << 24) | (b << 16) | (g << 8) | r;

/** A colour of the style sheet as three numbers. */
function ofStyle(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
}

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.image = null;
    this.table = new Uint32Array(65536);
    this.key = "";
    /** Names and colours of images whose values are names. */
    this.names = { material: [], cause: [] };
    /** The colour of a surface that has no name. */
    this.none = [128, 128, 128];
    this.gains = [];
    /** Whether a pixel with a part and a material stands out. `null` where all do. */
    this.stands = null;
  }

  /** Where the image lies on its canvas [CSS px], which may be of another shape. */
  placement() {
    const box = this.canvas.getBoundingClientRect();
    const { width, height } = this.canvas;
    const zoom = Math.min(box.width / width, box.height / height);
    return { zoom, left: (box.width - zoom * width) / 2, top: (box.height - zoom * height) / 2 };
  }

  /** The plane of numbers that is shown. Names have none, so temperatures stand for them. */
  plane(quantity) {
    return (quantity in this.names ? undefined : this.image?.planes[quantity]) ?? this.image?.planes.temperature;
  }

  /** Least and greatest value of what is seen. `null` where nothing is. */
  range(quantity) {
    if (!this.image) return null;
    const { values, scale, offset } = this.plane(quantity);
    const part = this.image.planes.part.values;
    let [low, high] = [65536, -1];
    for (let i = 0; i < values.length; i += 1) {
      if (part[i] === 0 && quantity !== "counts") continue;
      const value = values[i];
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return high < 0 ? null : [low * scale + offset, high * scale + offset];
  }

  /** Draws the image with a map of 256 colours over a range, or its materials or causes. */
  draw(quantity, map, [lower, upper]) {
    if (!this.image) return;
    const { header: { width, height }, planes } = this.image;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.pixels = null;
    }
    this.pixels ??= this.context.createImageData(width, height);
    const out = new Uint32Array(this.pixels.data.buffer);
    const space = word(ofStyle("--space"));
    const part = planes.part.values;
    if (quantity in this.names) {
      const colours = [word(this.none), ...this.names[quantity].map(({ colour }) => word(colour))];
      const { values } = planes[quantity];
      for (let i = 0; i < out.length; i += 1) {
        const border = i > 0 && part[i] !== part[i - 1];
        const colour = border ? (colours[values[i]] >> 1) & 0x7f7f7f | (255 << 24) : colours[values[i]];
        out[i] = part[i] === 0 ? space : colour;
      }
    } else {
      const { values, scale, offset } = this.plane(quantity);
      this.fill(map, scale, lower - offset, upper - offset);
      const table = this.table;
      const sky = quantity === "apparent" || quantity === "counts";
      for (let i = 0; i < out.length; i += 1) {
        out[i] = part[i] === 0 && !(sky && values[i] > 0) ? space : table[values[i]];
      }
    }
    if (this.stands) {
      // A quarter of the colour is left of what does not stand out.
      const rest = ((space >> 1) & 0x7f7f7f) + ((space >> 2) & 0x3f3f3f);
      const material = planes.material.values;
      for (let i = 0; i < out.length; i += 1) {
        if (part[i] !== 0 && !this.stands(part[i], material[i])) out[i] = ((out[i] >> 2) & 0x3f3f3f) + rest | (255 << 24);
      }
    }
    this.context.putImageData(this.pixels, 0, 0);
  }

  /** Least, mean and greatest value of the pixels that stand out, and their number. `null` without any. */
  statistics(quantity) {
    const { values, scale, offset } = this.plane(quantity);
    const [part, material] = [this.image.planes.part.values, this.image.planes.material.values];
    let [low, high, sum, count] = [65536, -1, 0, 0];
    for (let i = 0; i < values.length; i += 1) {
      if (part[i] === 0 || !this.stands(part[i], material[i])) continue;
      const value = values[i];
      if (value < low) low = value;
      if (value > high) high = value;
      sum += value;
      count += 1;
    }
    const value = (number) => number * scale + offset;
    return count === 0 ? null : { count, low: value(low), mean: value(sum / count), high: value(high) };
  }

  /** Colours of all numbers of 16 bits. */
  fill(map, scale, lower, upper) {
    const key = `${map.name} ${scale} ${lower} ${upper}`;
    if (key === this.key) return;
    this.key = key;
    const words = map.colours.map(word);
    const factor = 255 / Math.max(upper - lower, 1e-9);
    for (let value = 0; value < 65536; value += 1) {
      const place = Math.round((value * scale - lower) * factor);
      this.table[value] = words[Math.min(Math.max(place, 0), 255)];
    }
  }

  /** The pixel below a place on the screen. `null` beside the image. */
  pixelAt(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const { width, height } = this.canvas;
    const { zoom, left, top } = this.placement();
    const x = Math.floor((clientX - box.left - left) / zoom);
    const y = Math.floor((clientY - box.top - top) / zoom);
    return x >= 0 && y >= 0 && x < width && y < height ? { x, y } : null;
  }

  /** The value of a quantity at a pixel. */
  value(quantity, { x, y }) {
    const { values, scale, offset } = this.plane(quantity);
    return values[y * this.image.header.width + x] * scale + offset;
  }

  /** What a pixel shows. `null` without an image. */
  at({ x, y }) {
    if (!this.image) return null;
    const { header, planes } = this.image;
    const i = y * header.width + x;
    const value = (name) => planes[name] && planes[name].values[i] * planes[name].scale + planes[name].offset;
    return {
      x, y, part: value("part"), material: value("material"), temperature: value("temperature"), error: value("error"),
      sigma: value("sigma"), cause: this.names.cause[value("cause") - 1]?.name, apparent: value("apparent"), counts: value("counts"),
      gains: this.gains.map((name) => [name, value(name)]).filter(([, gain]) => gain !== undefined),
    };
  }
}
