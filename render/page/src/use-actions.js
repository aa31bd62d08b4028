/**
 * What the controls do with the scene.
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").Description} Description
 */
import { startOf } from "./state/scene.js";

/** A comparison for a frame of the volume. @param {Scene["compare"]} compare @param {Description} description @param {number} frame */
function compareAt(compare, description, frame) {
  if (!compare) return compare;
  const { frames } = description.files[compare.file];
  return { ...compare, frame: frames.includes(frame) ? frame : compare.frame };
}

/**
 * @param {object} with_
 * @param {import("./types.js").Backend} with_.backend
 * @param {Description} with_.description
 * @param {import("./state/store.js").Store} with_.store
 * @param {{width: number, height: number}} with_.pixels  of the picture
 * @param {(text: string) => void} with_.onMessage
 */
export function actionsOf({ backend, description, store, pixels, onMessage }) {
  const set = (/** @type {Partial<Scene>} */ change, moving = false) => store.set(change, { moving });
  const fit = async (view = "default", change = /** @type {Partial<Scene>} */ ({})) => {
    const { file, grid, frame, camera } = { ...store.scene, ...change };
    const orthographic = camera.height !== undefined;
    try {
      set({ ...change, camera: await backend.fit({ file, grid, frame, ...pixels, view, orthographic }) });
    } catch (error) {
      onMessage(/** @type {Error} */ (error).message);
    }
  };
  return {
    set,
    fit,
    setTransfer: (/** @type {Scene["transfer"]} */ transfer, moving = false) => set({ transfer }, moving),
    chooseGrid: (/** @type {number} */ file, /** @type {number} */ grid) => fit("default", startOf(description, file, grid)),
    setFrame: (/** @type {number} */ frame, moving = true) =>
      set({ frame, compare: compareAt(store.scene.compare, description, frame) }, moving),
  };
}
