/**
 * The outline of a histogram.
 * @typedef {import("../types.js").Histogram} Histogram
 * @typedef {import("./scales.js").Scales} Scales
 * @typedef {"linear" | "log"} CountScale
 */

/**
 * @param {Histogram} histogram @param {CountScale} scale @param {Scales} scales
 * @returns {string} the path of an SVG
 */
export function histogramPath({ low, high, counts }, scale, scales) {
  const height = (/** @type {number} */ count) => (scale === "log" ? Math.log1p(count) : count);
  const most = height(Math.max(...counts)) || 1;
  const bottom = scales.top + scales.height;
  const edge = (/** @type {number} */ bin) => scales.x(low + ((high - low) * bin) / counts.length).toFixed(1);
  const top = (/** @type {number} */ count) => (bottom - (height(count) / most) * scales.height).toFixed(1);
  const steps = counts.map((count, bin) => `V${top(count)}H${edge(bin + 1)}`);
  return `M${edge(0)},${bottom}${steps.join("")}V${bottom}Z`;
}
