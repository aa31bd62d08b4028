/**
 * Transfer functions: evaluated as the library does (esvr/transfer_function.h), and edited. No
 * function here changes what it is given.
 * @typedef {import("../types.js").Transfer} Transfer
 * @typedef {import("../types.js").ColorPoint} ColorPoint
 * @typedef {import("../types.js").OpacityPoint} OpacityPoint
 * @typedef {import("../types.js").ColorMap} ColorMap
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {[number, number]} Range
 */
import { mixed } from "./color-spaces.js";

// VTK interpolates linearly below the first sharpness and makes a step above the second one.
const kStraight = 0.01, kStepped = 0.99;

/**
 * Index of the first point whose value is larger.
 * @param {readonly number[][]} points @param {number} x
 */
function nextIndex(points, x) {
  const index = points.findIndex((p) => x < p[0]);
  return index < 0 ? points.length : index;
}

/** @param {number[]} a @param {number[]} b @param {number} x */
const fraction = (a, b, x) => (x - a[0]) / (b[0] - a[0]);

/** @param {{space: string, colors: ColorPoint[]}} look @param {number} x @returns {Triple} */
export function colorAt({ space, colors }, x) {
  const next = nextIndex(colors, x);
  const last = colors[Math.max(0, next - 1)];
  const [, ...color] = last;
  if (next === 0 || next === colors.length || x === last[0]) return color;
  const [, ...after] = colors[next];
  return mixed(space, color, after, fraction(last, colors[next], x));
}

/** @param {number} s @param {number} midpoint */
function bentAtMidpoint(s, midpoint) {
  if (s < midpoint) return (0.5 * s) / midpoint;
  return midpoint < 1 ? 0.5 + (0.5 * (s - midpoint)) / (1 - midpoint) : 1;
}

/** @param {number} s @param {number} sharpness @param {number} y1 @param {number} y2 */
function sharpened(s, sharpness, y1, y2) {
  const power = 1 + 10 * sharpness;
  s = s < 0.5 ? 0.5 * (2 * s) ** power : 1 - 0.5 * (2 * (1 - s)) ** power;
  const s2 = s * s, s3 = s2 * s, tangent = (1 - sharpness) * (y2 - y1);
  const y = (2 * s3 - 3 * s2 + 1) * y1 + (3 * s2 - 2 * s3) * y2 + (s3 - 2 * s2 + s) * tangent + (s3 - s2) * tangent;
  return Math.min(Math.max(y, Math.min(y1, y2)), Math.max(y1, y2));
}

/** @param {OpacityPoint} a @param {OpacityPoint} b @param {number} x */
function opacityBetween(a, b, x) {
  const [, from, midpoint, sharpness] = a, to = b[1];
  const s = bentAtMidpoint(fraction(a, b, x), midpoint);
  if (sharpness > kStepped) return s < 0.5 ? from : to;
  if (sharpness < kStraight) return (1 - s) * from + s * to;
  return sharpened(s, sharpness, from, to);
}

/** @param {OpacityPoint[]} curve @param {number} x */
export function opacityAt(curve, x) {
  const next = nextIndex(curve, x);
  const last = curve[Math.max(0, next - 1)];
  if (next === 0 || next === curve.length || x === last[0]) return last[1];
  return opacityBetween(last, curve[next], x);
}

/** @param {readonly number[][]} points @returns {Range} */
export const extentOf = (points) => [points[0][0], points[points.length - 1][0]];

/** The values over which a function changes. @param {Transfer} transfer @returns {Range} */
export function rangeOf({ colors, opacity }) {
  const [a, b] = extentOf(colors), [c, d] = extentOf(opacity);
  return [Math.min(a, c), Math.max(b, d)];
}

/**
 * Moves points as the range `from` is stretched to the range `to`.
 * @template {number[]} P
 * @param {P[]} points @param {Range} from @param {Range} to
 * @returns {P[]}
 */
export function stretched(points, from, to) {
  const scale = from[1] > from[0] ? (to[1] - to[0]) / (from[1] - from[0]) : 0;
  return points.map(([x, ...rest]) => /** @type {P} */ ([to[0] + (x - from[0]) * scale, ...rest]));
}

/** @param {Transfer} transfer @param {Range} range @returns {Transfer} */
export function withRange(transfer, range) {
  const from = rangeOf(transfer);
  return {
    ...transfer,
    colors: stretched(transfer.colors, from, range),
    opacity: stretched(transfer.opacity, from, range),
  };
}

/** Puts a color map over the range of the colors. @param {Transfer} transfer @param {ColorMap} map */
export function withColorMap(transfer, { space, points }) {
  const colors = stretched(points, extentOf(points), extentOf(transfer.colors));
  return { ...transfer, space, colors };
}

/** Puts a curve over the range of the opacities. @param {Transfer} transfer @param {OpacityPoint[]} curve */
export function withCurve(transfer, curve) {
  return { ...transfer, opacity: stretched(curve, extentOf(curve), extentOf(transfer.opacity)) };
}

/** Mirrors the colors. @param {Transfer} transfer @returns {Transfer} */
export function withInvertedColors(transfer) {
  const [low, high] = extentOf(transfer.colors);
  const colors = transfer.colors.map(([x, ...c]) => /** @type {ColorPoint} */ ([low + high - x, ...c])).reverse();
  return { ...transfer, colors };
}

/** Replaces the colors by a few that can be edited. @param {Transfer} transfer @param {number} count */
export function withFewerColors(transfer, count) {
  const [low, high] = extentOf(transfer.colors);
  const places = Array.from({ length: count }, (_, i) => low + ((high - low) * i) / (count - 1));
  return { ...transfer, colors: places.map((x) => /** @type {ColorPoint} */ ([x, ...colorAt(transfer, x)])) };
}

/**
 * Changes a point; its value stays between those of its neighbours.
 * @template {number[]} P
 * @param {P[]} points @param {number} index @param {NoInfer<P>} point
 * @returns {P[]}
 */
export function withPoint(points, index, point) {
  const low = points[index - 1]?.[0] ?? -Infinity, high = points[index + 1]?.[0] ?? Infinity;
  const [x, ...rest] = point;
  const kept = /** @type {P} */ ([Math.min(high, Math.max(low, x)), ...rest]);
  return points.map((p, i) => (i === index ? kept : p));
}

/**
 * @template P
 * @param {P[]} points @param {number} index
 * @returns {P[]}
 */
export function withoutPoint(points, index) {
  return points.filter((_, i) => i !== index);
}

/**
 * Adds a point.
 * @template {number[]} P
 * @param {P[]} points @param {NoInfer<P>} point
 * @returns {{points: P[], index: number}}
 */
export function withAddedPoint(points, point) {
  const index = nextIndex(points, point[0]);
  return { points: points.toSpliced(index, 0, point), index };
}

/** @param {number[][]} a @param {number[][]} b */
function samePoints(a, b) {
  const scale = Math.max(...extentOf(b).map(Math.abs), 1e-30);
  const near = (/** @type {number} */ v, /** @type {number} */ w, /** @type {number} */ i) =>
    Math.abs(v - w) <= 1e-9 * (i === 0 ? scale : 1);
  return a.length === b.length && a.every((p, i) => p.every((v, j) => near(v, b[i][j], j)));
}

/**
 * Name of the color map that a function has; "" if it has another one.
 * @param {Transfer} transfer @param {Record<string, ColorMap>} maps
 */
export function colorMapName(transfer, maps) {
  const range = extentOf(transfer.colors);
  const same = (/** @type {ColorMap} */ { space, points }) =>
    space === transfer.space && samePoints(stretched(points, extentOf(points), range), transfer.colors);
  return Object.keys(maps).find((name) => same(maps[name])) ?? "";
}

/**
 * Name of the opacity curve that a function has; "" if it has another one.
 * @param {Transfer} transfer @param {Record<string, OpacityPoint[]>} curves
 */
export function curveName(transfer, curves) {
  const range = extentOf(transfer.opacity);
  const same = (/** @type {OpacityPoint[]} */ curve) =>
    samePoints(stretched(curve, extentOf(curve), range), transfer.opacity);
  return Object.keys(curves).find((name) => same(curves[name])) ?? "";
}
