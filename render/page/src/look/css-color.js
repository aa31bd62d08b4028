/**
 * Colors as text.
 * @typedef {import("../types.js").Triple} Triple
 */

/** "#rrggbb" @param {Triple} color */
export function hexOf(color) {
  return "#" + color.map((v) => Math.round(255 * v).toString(16).padStart(2, "0")).join("");
}

/** @param {string} hex  "#rrggbb" @returns {Triple} */
export function tripleOf(hex) {
  const channel = (/** @type {number} */ at) => parseInt(hex.slice(at, at + 2), 16) / 255;
  return [channel(1), channel(3), channel(5)];
}
