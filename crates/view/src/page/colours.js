// Colours: of runs, of values, and of everything drawn, from the style sheet.

/** Points of the sequential map (after viridis, without its darkest end) and of the diverging one. */
const SEQUENTIAL = ["#443983", "#31688e", "#21918c", "#35b779", "#90d743", "#fde725"];
const DIVERGING = ["#1f5fa8", "#6aa6d6", "#b7bdc6", "#e8935a", "#b2410c"];
const NOT_KNOWN = "#8a8f96";
const RUN_COLOURS = 8;

const parseColour = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));

/** The colour at a share from 0 to 1 of a list of colours, as [r, g, b] to 255. */
function mixed(points, share) {
  const place = Math.min(Math.max(share, 0), 1) * (points.length - 1);
  const i = Math.min(Math.floor(place), points.length - 2);
  const [a, b] = [parseColour(points[i]), parseColour(points[i + 1])];
  return a.map((x, k) => Math.round(x + (b[k] - x) * (place - i)));
}

/** Colours of the codes 0 to 255 of a channel, as 32-bit words that WebGL reads as r, g, b, a. */
function codeColours(range) {
  const points = range.low < 0 ? DIVERGING : SEQUENTIAL;
  const words = new Uint32Array(256);
  for (let code = 0; code < 256; code++)
    words[code] = word(code === UNKNOWN ? parseColour(NOT_KNOWN) : mixed(points, code / TOP));
  return words;
}

const word = ([r, g, b]) => new Uint32Array(new Uint8Array([r, g, b, 255]).buffer)[0];

/** The value at a share from 0 to 1 of a channel's range. */
function valueAt(range, share) {
  if (range.scale === "linear") return range.low + share * (range.high - range.low);
  if (range.scale === "log") return range.low * (range.high / range.low) ** share;
  const unit = range.high / 1000;
  return unit * Math.sinh((2 * share - 1) * Math.asinh(range.high / unit));
}

/** One range around those of several runs, so that a colour means the same in all. */
function unitedRange(ranges) {
  const low = Math.min(...ranges.map((range) => range.low));
  const high = Math.max(...ranges.map((range) => range.high));
  if (low < 0) {
    const end = Math.max(-low, high);
    return { low: -end, high: end, scale: ranges.some((range) => range.scale === "asinh") ? "asinh" : "linear" };
  }
  const positive = ranges.filter((range) => range.high > 0);
  if (positive.length === 0 || !positive.some((range) => range.scale === "log")) return { low, high, scale: "linear" };
  const lows = positive.map((range) => (range.scale === "log" ? range.low : range.high / 1000));
  return { low: Math.min(...lows), high, scale: "log" };
}

/** Where a value lies in a range, as a share; the inverse of `valueAt`. */
function shareOf(range, value) {
  if (range.high <= range.low) return 0;
  const inside = Math.min(Math.max(value, range.low), range.high);
  if (range.scale === "linear") return (inside - range.low) / (range.high - range.low);
  if (range.scale === "log") return Math.log(inside / range.low) / Math.log(range.high / range.low);
  return (Math.asinh((1000 * inside) / range.high) / Math.asinh(1000) + 1) / 2;
}

/** Colours of the codes of one run's range on the range that all runs share. */
function recoded(own, shared) {
  const colours = codeColours(shared);
  const code = (i) => Math.round(TOP * shareOf(shared, own.high > own.low ? valueAt(own, i / TOP) : own.low));
  return Uint32Array.from(colours, (_, i) => colours[i === UNKNOWN ? UNKNOWN : code(i)]);
}

/** A colour of the theme as a word. */
const paint = (theme, name) => word(theme.colour[name].map((c) => Math.round(255 * c)));

/** What the style sheet says now: colours as [r, g, b] to 1, and as text for the canvas of the chart. */
function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const text = (name) => style.getPropertyValue(`--${name}`).trim();
  const names = ["load", "contact", "sky", "ground", "line", "obstacle", "shadow", "ink", "muted", "grid", "surface", "axis"];
  const colour = Object.fromEntries(names.map((name) => [name, parseColour(text(name)).map((c) => c / 255)]));
  const runs = Array.from({ length: RUN_COLOURS }, (_, i) => text(`s${i}`));
  return { colour, text, runs, stripe: Number(text("stripe")) };
}
