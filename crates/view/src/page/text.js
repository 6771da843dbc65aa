// Numbers and labels as text.

const SUPERSCRIPTS = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

/** A number to so many significant digits: "0.25", "1.2×10⁻⁵". */
function formatNumber(value, digits = 2) {
  if (value === 0) return "0";
  const [mantissa, exponent] = Math.abs(value).toExponential(digits - 1).split("e");
  const sign = value < 0 ? "−" : "";
  if (exponent < -3 || exponent > 4) {
    const power = [...String(Number(exponent))].map((c) => SUPERSCRIPTS[c]).join("");
    const factor = Number(mantissa) === 1 ? "" : `${Number(mantissa)}×`;
    return `${sign}${factor}10${power}`;
  }
  return sign + String(Number(Number(`${mantissa}e${exponent}`).toFixed(Math.max(0, digits - 1 - exponent))));
}

/** The largest of 1, 2 and 5 times a power of ten that is not above `value` > 0. */
function niceBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].map((k) => k * power).find((nice) => nice <= value * (1 + 1e-9)) ?? power;
}

const element = (id) => document.getElementById(id);

/** A new element with properties and children. */
function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}
