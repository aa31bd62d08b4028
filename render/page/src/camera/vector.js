/**
 * Vectors of three numbers.
 * @typedef {import("../types.js").Triple} Triple
 */

/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {Triple} a @param {number} s @returns {Triple} */
export const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @param {Triple} a @param {Triple} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
/** @param {Triple} a */
export const lengthOf = (a) => Math.hypot(a[0], a[1], a[2]);
/** @param {Triple} a @returns {Triple} */
export const unitOf = (a) => times(a, 1 / lengthOf(a));

/** Edges of a cube. @type {import("../types.js").Edges} */
export const kCube = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
/** A place or a direction of the index space in the camera's space. @param {import("../types.js").Edges | null} edges @param {Triple} v */
export function placeOf(edges, v) {
  const [a, b, c] = edges ?? kCube;
  return plus(plus(times(a, v[0]), times(b, v[1])), times(c, v[2]));
}
/**
 * The rows of the inverse: their inner products with a vector of the camera's space are its coordinates in
 * the index space.
 * @param {import("../types.js").Edges | null} edges @returns {import("../types.js").Edges}
 */
export function inverseOf(edges) {
  const [a, b, c] = edges ?? kCube, volume = 1 / dot(a, cross(b, c));
  return [times(cross(b, c), volume), times(cross(c, a), volume), times(cross(a, b), volume)];
}

/**
 * Turns a vector about an axis of length 1 (Rodrigues' formula).
 * @param {Triple} v @param {Triple} axis @param {number} angle  radians
 */
export function turned(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return plus(plus(times(v, c), times(cross(axis, v), s)), times(axis, dot(axis, v) * (1 - c)));
}
