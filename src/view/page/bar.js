// The colour bar: the map from its lower to its upper end, with ticks, and a mark of the value under the pointer.

/** A round distance between two ticks. */
export function tick(span, most) {
  const rough = span / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
}

/** Multiples of a round distance in a range, without the rounding of their products. */
export function ticks([lower, upper], most) {
  if (!(upper > lower)) return [];
  const step = tick(upper - lower, most);
  const first = Math.ceil(lower / step - 1e-9);
  const count = Math.floor(upper / step + 1e-9) - first + 1;
  return Array.from({ length: count }, (_, i) => Number(((first + i) * step).toPrecision(9)));
}

/** Fits a canvas to its place on the screen. Returns its context, and its width and height in CSS pixels. */
export function fitted(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return [context, width, height];
}

/** A colour of the style sheet. */
export const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Space for the mark above the colours, and height of the colours [CSS px]. */
const [ABOVE, HIGH] = [7, 14];

/** Draws a bar from `left` to `right` below `top`, with ticks. */
export function drawScale(context, map, range, [left, right, top]) {
  const count = Math.round(right - left);
  for (let x = 0; x < count; x += 1) {
    const [r, g, b] = map.colours[Math.round((255 * x) / Math.max(count - 1, 1))];
    context.fillStyle = `rgb(${r},${g},${b})`;
    context.fillRect(left + x, top, 1, HIGH);
  }
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "top";
  context.textAlign = "center";
  context.fillStyle = context.strokeStyle = ink("--faint");
  context.lineWidth = 1;
  for (const value of ticks(range, Math.max(2, Math.min(6, count / 55)))) {
    const x = left + ((right - left) * (value - range[0])) / (range[1] - range[0]);
    context.beginPath();
    context.moveTo(x, top + HIGH);
    context.lineTo(x, top + HIGH + 4);
    context.stroke();
    const half = context.measureText(`${value}`).width / 2;
    context.fillText(`${value}`, Math.min(Math.max(x, half), right - half), top + HIGH + 6);
  }
}

/** Draws the bar of the page. `value` is what lies under the pointer, where something does. */
export function drawBar(canvas, map, range, unit, value) {
  const [context, width] = fitted(canvas);
  drawScale(context, map, range, [0, width, ABOVE]);
  const told = value === undefined ? "" : `. Under the pointer: ${value.toFixed(2)} ${unit}`;
  canvas.setAttribute("aria-label", `Colours from ${range[0]} to ${range[1]} ${unit}${told}`);
  canvas.dataset.mark = "";
  if (value === undefined) return;
  const share = (value - range[0]) / (range[1] - range[0]);
  const x = Math.min(Math.max(share, 0), 1) * width;
  canvas.dataset.mark = share.toFixed(4);
  context.fillStyle = ink("--ink");
  context.beginPath();
  context.moveTo(x, ABOVE);
  context.lineTo(x - 5, 0);
  context.lineTo(x + 5, 0);
  context.fill();
  context.fillRect(Math.min(Math.max(x - 1, 0), width - 2), ABOVE, 2, HIGH);
}
