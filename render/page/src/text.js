/**
 * Numbers and colors as text.
 * @typedef {import("./types.js").Triple} Triple
 */

/** At most `digits` significant digits. @param {number} v @param {number} [digits] */
export function shortText(v, digits = 4) {
  if (v === 0) return "0";
  const size = Math.abs(v);
  return size >= 1e6 || size < 1e-4 ? v.toExponential(digits - 2).replace(/\.?0+e/, "e") : String(Number(v.toPrecision(digits)));
}

/** @param {number} bytes */
export function bytesText(bytes) {
  const units = ["bytes", "KB", "MB", "GB", "TB"];
  let power = 0;
  for (; bytes >= 1000 && power < units.length - 1; ++power) bytes /= 1000;
  return `${power === 0 ? bytes : Number(bytes.toPrecision(3))} ${units[power]}`;
}

/** With separators between thousands. @param {number} v */
export const countText = (v) => v.toLocaleString("en-US");

/** "#rrggbb" @param {Triple} color */
export function hexOf(color) {
  return "#" + color.map((v) => Math.round(255 * v).toString(16).padStart(2, "0")).join("");
}

/** @param {string} hex  "#rrggbb" @returns {Triple} */
export function tripleOf(hex) {
  const channel = (/** @type {number} */ at) => parseInt(hex.slice(at, at + 2), 16) / 255;
  return [channel(1), channel(3), channel(5)];
}
