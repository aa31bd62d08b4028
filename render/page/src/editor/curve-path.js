/**
 * The opacity curve as a path.
 * @typedef {import("../types.js").OpacityPoint} OpacityPoint
 * @typedef {import("./scales.js").Scales} Scales
 */
import { opacityAt } from "../look/transfer.js";

const kPixelsApart = 2;

/** @param {OpacityPoint[]} curve @param {Scales} scales */
export function curvePath(curve, scales) {
  const count = Math.ceil(scales.width / kPixelsApart);
  const even = Array.from({ length: count + 1 }, (_, i) => scales.low + ((scales.high - scales.low) * i) / count);
  const own = curve.map((p) => p[0]).filter((x) => x >= scales.low && x <= scales.high);
  const values = [...even, ...own].sort((a, b) => a - b);
  return values.map((v, i) => `${i ? "L" : "M"}${scales.x(v).toFixed(1)},${scales.y(opacityAt(curve, v)).toFixed(1)}`).join("");
}

/** The area below a curve. @param {string} path @param {Scales} scales */
export function areaBelow(path, scales) {
  const bottom = scales.top + scales.height;
  return `${path}L${scales.left + scales.width},${bottom}L${scales.left},${bottom}Z`;
}
