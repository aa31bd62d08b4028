/**
 * Arithmetic on places and directions.
 * @typedef {import("../types.js").Triple} Triple
 */

/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const difference = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const sum = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {Triple} a @param {number} s @returns {Triple} */
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Triple} a */
export const length = (a) => Math.hypot(...a);
/** @param {Triple} a */
export const unit = (a) => scaled(a, 1 / length(a));
