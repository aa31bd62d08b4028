/**
 * A camera as what the shader needs, in the index space of a level of detail (libesvr/render/view.h,
 * brick_march.h).
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {import("../types.js").Camera} Camera
 */
import { cross, difference, length, scaled, unit } from "./vectors.js";

/** Voxels of a level along the side of a pixel where it begins, as in the library. */
const kVoxelsPerPixel = 3;
const kLastLevel = 7;

/** A place in units of the voxels of a level. @param {Triple} place @param {number} level @returns {Triple} */
export function placeInLevel(place, level) {
  const side = 2 ** level, offset = 0.5 * (side - 1);
  return /** @type {Triple} */ (place.map((v) => (v - offset) / side));
}

/** The plane of the picture: its height at a depth of 1, or in voxels for parallel rays. @param {Camera} camera */
const planeHeight = ({ fov, height }) => height ?? 2 * Math.tan(((fov ?? 30) * Math.PI) / 360);

/**
 * @param {Camera} camera @param {{width: number, height: number}} size
 * @param {number} level @param {Triple} origin  a voxel of the level, to which places are relative
 */
export function viewOf(camera, size, level, origin) {
  const forward = unit(difference(camera.center, camera.eye));
  const right = unit(cross(forward, camera.up));
  const perspective = camera.height === undefined;
  const height = planeHeight(camera) / (perspective ? 1 : 2 ** level);
  const width = (height * size.width) / size.height;
  return {
    eye: difference(placeInLevel(camera.eye, level), origin),
    right, up: cross(right, forward), forward, perspective, left: -width / 2, top: height / 2, width, height,
  };
}

/**
 * The level of detail of a picture. The library changes levels along a ray; here, the middle of the
 * volume decides.
 * @param {Camera} camera @param {number} height  in pixels @param {Triple} middle
 */
export function levelOf(camera, height, middle) {
  const distance = camera.height === undefined ? length(difference(middle, camera.eye)) : 1;
  const voxels = (planeHeight(camera) * distance) / height / kVoxelsPerPixel;
  return Math.min(kLastLevel, Math.max(0, Math.floor(Math.log2(voxels))));
}

/** The direction to a light above the left shoulder of someone at the camera's place. */
export const lightOf = (/** @type {ReturnType<typeof viewOf>} */ { right, up, forward }) =>
  unit(difference(difference(scaled(up, 0.6), scaled(right, 0.5)), forward));
