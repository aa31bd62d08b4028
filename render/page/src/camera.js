/**
 * The camera: vectors, moves and projection. No function here changes what it is given.
 * @typedef {import("./types.js").Camera} Camera
 * @typedef {import("./types.js").Edges} Edges
 * @typedef {import("./types.js").Triple} Triple
 * @typedef {{width: number, height: number}} Size
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
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
/** @param {Triple} a */
export const lengthOf = (a) => Math.hypot(a[0], a[1], a[2]);
/** @param {Triple} a @returns {Triple} */
export const unitOf = (a) => times(a, 1 / lengthOf(a));

/** Edges of a cube. @type {Edges} */
export const kCube = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
/** A place or a direction of the index space in the camera's space. @param {Edges | null} edges @param {Triple} v */
export function placeOf(edges, v) {
  const [a, b, c] = edges ?? kCube;
  return plus(plus(times(a, v[0]), times(b, v[1])), times(c, v[2]));
}
/**
 * The rows of the inverse: their inner products with a vector of the camera's space are its coordinates in
 * the index space.
 * @param {Edges | null} edges @returns {Edges}
 */
export function inverseOf(edges) {
  const [a, b, c] = edges ?? kCube, volume = 1 / dot(a, cross(b, c));
  return [times(cross(b, c), volume), times(cross(c, a), volume), times(cross(a, b), volume)];
}

/**
 * Turns a vector about an axis of length 1 (Rodrigues' formula).
 * @param {Triple} v @param {Triple} axis @param {number} angle  radians
 */
function turned(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return plus(plus(times(v, c), times(cross(axis, v), s)), times(axis, dot(axis, v) * (1 - c)));
}

/** The direction that stays upright while the camera orbits. @type {Triple} */
const kUpright = [0, 1, 0];
const kHalfTurn = Math.PI / 2;

/** The axes of the picture, each of length 1. @param {Camera} camera */
export function frameOf({ eye, center, up }) {
  const forward = unitOf(minus(center, eye));
  const right = unitOf(cross(forward, up));
  return { forward, right, up: cross(right, forward) };
}

/** Height in voxels of what the picture shows at the distance of the center. @param {Camera} camera */
export function heightAtCenter({ eye, center, fov, height }) {
  return height ?? 2 * lengthOf(minus(center, eye)) * Math.tan(((fov ?? 30) * Math.PI) / 360);
}

/**
 * Turns the camera about its center. It stops above and below the volume, so that it never stands on
 * its head.
 * @param {Camera} camera @param {number} sideways @param {number} upwards  radians
 * @returns {Camera}
 */
export function orbited(camera, sideways, upwards) {
  const { forward, right, up } = frameOf(camera);
  const elevation = Math.atan2(-dot(forward, kUpright), dot(up, kUpright));
  const tilt = Math.min(kHalfTurn, Math.max(-kHalfTurn, elevation + upwards)) - elevation;
  const moved = (/** @type {Triple} */ v) => turned(turned(v, right, -tilt), kUpright, -sideways);
  return { ...camera, eye: plus(camera.center, moved(minus(camera.eye, camera.center))), up: moved(up) };
}

/**
 * Shifts the camera so that the volume follows the pointer.
 * @param {Camera} camera @param {number} x @param {number} y  shares of the picture's height, to the
 *   right and upwards
 * @returns {Camera}
 */
export function panned(camera, x, y) {
  const { right, up } = frameOf(camera), height = heightAtCenter(camera);
  const shift = plus(times(right, -x * height), times(up, -y * height));
  return { ...camera, eye: plus(camera.eye, shift), center: plus(camera.center, shift) };
}

/** @param {Camera} camera @param {number} factor  above 1: larger @returns {Camera} */
export function zoomed(camera, factor) {
  if (camera.height !== undefined) return { ...camera, height: camera.height / factor };
  const arm = times(minus(camera.eye, camera.center), 1 / factor);
  return { ...camera, eye: plus(camera.center, arm) };
}

/**
 * Zooms, and keeps what is at a place of the picture there.
 * @param {Camera} camera @param {number} factor
 * @param {number} x @param {number} y  from the middle, as for panned()
 */
export function zoomedAt(camera, factor, x, y) {
  const share = 1 - 1 / factor;
  return zoomed(panned(camera, -x * share, -y * share), factor);
}

/** Exchanges perspective and parallel rays; the size at the center remains. @param {Camera} camera */
export function withParallelRays(camera, parallel, fov = 30) {
  const { eye, center, up } = camera, height = heightAtCenter(camera);
  if (parallel) return { eye, center, up, height };
  const distance = height / 2 / Math.tan((fov * Math.PI) / 360);
  return { eye: plus(center, times(unitOf(minus(eye, center)), distance)), center, up, fov };
}

/**
 * @param {Camera} camera @param {Size} size
 * @param {Edges | null} [edges]  of the voxels whose places are projected
 * @returns {(place: Triple) => [number, number] | null}  null: behind the camera
 */
export function projectionOf(camera, { width, height }, edges = null) {
  const { forward, right, up } = frameOf(camera);
  const distance = lengthOf(minus(camera.center, camera.eye));
  const scale = height / heightAtCenter(camera);
  return (place) => {
    const arm = minus(placeOf(edges, place), camera.eye), depth = dot(arm, forward);
    if (camera.height === undefined && depth < 1e-3 * distance) return null;
    const s = camera.height === undefined ? (scale * distance) / depth : scale;
    return [width / 2 + s * dot(arm, right), height / 2 - s * dot(arm, up)];
  };
}
