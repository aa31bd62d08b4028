/**
 * From places in the volume to places in the picture.
 * @typedef {import("../types.js").Camera} Camera
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {{width: number, height: number}} Size
 */
import { frameOf, heightAtCenter } from "./orbit.js";
import { dot, lengthOf, minus, placeOf } from "./vector.js";

/**
 * @param {Camera} camera @param {Size} size
 * @param {import("../types.js").Edges | null} [edges]  of the voxels whose places are projected
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
