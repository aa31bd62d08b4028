/**
 * Which values the members of a scene may have. Links can be cut off, or be written by hand.
 * @typedef {(value: any) => boolean} Check
 */

const isFinite = (/** @type {any} */ v) => Number.isFinite(v);
/** @param {number} count @returns {Check} */
const numbers = (count) => (v) => Array.isArray(v) && v.length === count && v.every(isFinite);
/** @param {any[]} values @returns {Check} */
const oneOf = (...values) => (v) => values.includes(v);
/** @param {Check} check @returns {Check} */
const orNull = (check) => (v) => v === null || check(v);
/** @param {Record<string, Check>} checks @returns {Check} */
const object = (checks) => (v) => typeof v === "object" && v !== null && Object.keys(checks).every((name) => checks[name](v[name]));
/** @type {Check} */
const isPositive = (v) => isFinite(v) && v > 0;
/** @type {Check} */
const isIndex = (v) => Number.isInteger(v) && v >= 0;
/** @type {Check} */
const isBoolean = (v) => typeof v === "boolean";
/** @type {Check} */
const isTriple = numbers(3);
/** @type {Check} */
const isShare = (v) => isFinite(v) && v >= 0 && v <= 1;

/** Points whose values do not decrease, each with further members between 0 and 1. @type {Check} */
const isCurve = (v) =>
  Array.isArray(v) && v.length > 0 && v.every(numbers(4)) &&
  v.every((p, i) => p.slice(1).every(isShare) && (i === 0 || v[i - 1][0] <= p[0]));

/** @type {Check} */
const isCamera = (v) =>
  object({ eye: isTriple, center: isTriple, up: isTriple })(v) &&
  (isPositive(v.height) || (isPositive(v.fov) && v.fov < 180)) && String(v.eye) !== String(v.center);

/** @type {Record<string, Check>} */
export const kChecks = {
  frame: orNull(Number.isInteger),
  camera: isCamera,
  transfer: object({ space: oneOf("RGB", "HSV", "HSVWrap", "Lab", "Diverging", "Step"), colors: isCurve, opacity: isCurve }),
  opacityLength: isPositive,
  step: isPositive,
  mode: oneOf("composite", "maximum", "average"),
  classification: oneOf("pre", "post"),
  shade: isBoolean,
  lod: oneOf("auto", "off"),
  between: oneOf("voxels", "sum"),
  background: orNull((v) => isTriple(v) && v.every(isShare)),
  clip: orNull((v) => Array.isArray(v) && v.length === 2 && v.every(isTriple)),
  slice: orNull(object({ axis: oneOf("x", "y", "z"), place: isFinite })),
  compare: orNull(object({
    file: isIndex, grid: isIndex, frame: orNull(Number.isInteger),
    show: oneOf("split", "reference", "difference"), split: isShare, gain: isFinite,
  })),
};
