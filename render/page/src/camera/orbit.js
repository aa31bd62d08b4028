/**
 * Moves a camera. No function here changes what it is given.
 * @typedef {import("../types.js").Camera} Camera
 * @typedef {import("../types.js").Triple} Triple
 */
import { cross, dot, lengthOf, minus, plus, times, turned, unitOf } from "./vector.js";

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
