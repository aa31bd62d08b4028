/**
 * The scene that the page begins with, and its changes.
 * @typedef {import("../types.js").Scene} Scene
 * @typedef {import("../types.js").Grid} Grid
 * @typedef {import("../types.js").Description} Description
 * @typedef {import("../types.js").Triple} Triple
 */

/** The members whose defaults do not depend on the volume. They are those of esvr-render. */
export const kDefaults = Object.freeze({
  opacityLength: 1,
  step: 1,
  mode: /** @type {const} */ ("composite"),
  classification: /** @type {const} */ ("pre"),
  shade: false,
  lod: /** @type {const} */ ("auto"),
  between: /** @type {const} */ ("voxels"),
  background: null,
  clip: null,
  slice: null,
  compare: null,
});

/** @param {Description} description @param {{file: number, grid: number}} place */
export const gridOf = (description, { file, grid }) => description.files[file].grids[grid];

/** @param {Description} description @param {number} file @param {number} grid */
export function startOf(description, file, grid) {
  const { space, colors, opacity } = gridOf(description, { file, grid }).defaultLook;
  const frame = description.files[file].frames[0] ?? null;
  return { ...kDefaults, file, grid, frame, transfer: { space, colors, opacity } };
}

/**
 * Corners of what is drawn: up to one voxel outside the outermost voxels, because values are
 * interpolated up to there.
 * @param {Grid} grid @returns {[Triple, Triple]}
 */
export function edgesOf({ box: [low, high] }) {
  const moved = (/** @type {Triple} */ corner, /** @type {number} */ by) =>
    /** @type {Triple} */ (corner.map((v) => v + by));
  return [moved(low, -1), moved(high, 1)];
}
