/**
 * A camera as what the shader needs, in the index space of a level of detail (libesvr/render/view.h,
 * brick_march.h). Lengths along rays are those of the camera's space (esvr/camera.h).
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {import("../types.js").Camera} Camera
 * @typedef {import("../types.js").Edges} Edges
 */
import { dot, inverseOf, kCube, placeOf } from "../camera/vector.js";
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
 * The axes of the picture as steps in the index space, and in the camera's space.
 * @param {Camera} camera @param {{width: number, height: number}} size
 * @param {number} level @param {Triple} origin  a voxel of the level, to which places are relative
 * @param {Edges | null} edges  of a voxel
 */
export function viewOf(camera, size, level, origin, edges) {
  const forward = unit(difference(camera.center, camera.eye));
  const right = unit(cross(forward, camera.up));
  const perspective = camera.height === undefined;
  const height = planeHeight(camera) / (perspective ? 1 : 2 ** level);
  const width = (height * size.width) / size.height;
  const rows = inverseOf(edges), up = cross(right, forward);
  const inIndex = (/** @type {Triple} */ v) => /** @type {Triple} */ (rows.map((row) => dot(row, v)));
  return {
    eye: difference(placeInLevel(inIndex(camera.eye), level), origin),
    right: inIndex(right), up: inIndex(up), forward: inIndex(forward),
    axes: { right, up, forward }, edges: edges ?? kCube, rows,
    perspective, left: -width / 2, top: height / 2, width, height,
  };
}

/**
 * The level of detail of a picture. The library changes levels along a ray; here, the middle of the
 * volume decides.
 * @param {Camera} camera @param {number} height  in pixels @param {Triple} middle  in index space
 * @param {Edges | null} edges  of a voxel
 */
export function levelOf(camera, height, middle, edges) {
  const distance = camera.height === undefined ? length(difference(placeOf(edges, middle), camera.eye)) : 1;
  const voxel = Math.max(...(edges ?? kCube).map(length));
  const voxels = (planeHeight(camera) * distance) / height / (kVoxelsPerPixel * voxel);
  return Math.min(kLastLevel, Math.max(0, Math.floor(Math.log2(voxels))));
}

/** The direction to a light above the left shoulder of someone at the camera's place. */
export const lightOf = (/** @type {ReturnType<typeof viewOf>} */ { axes: { right, up, forward } }) =>
  unit(difference(difference(scaled(up, 0.6), scaled(right, 0.5)), forward));
