/**
 * The scene as the part of the address behind '#', so that a link reproduces the view. Members that
 * have their usual value are left out.
 * @typedef {import("../types.js").Scene} Scene
 * @typedef {import("../types.js").Description} Description
 */
import { kChecks } from "./checks.js";
import { startOf } from "./scene.js";

/** @param {Scene} scene @param {Description} description */
export function hashOf(scene, description) {
  const usual = /** @type {Record<string, unknown>} */ (startOf(description, scene.file, scene.grid));
  const members = new URLSearchParams();
  for (const [name, value] of Object.entries(scene)) {
    const text = JSON.stringify(value);
    if (name === "file" || name === "grid" || text !== JSON.stringify(usual[name])) members.set(name, text);
  }
  return "#" + members.toString();
}

/** @param {string | null} text */
function parsed(text) {
  try {
    return text === null ? undefined : JSON.parse(text);
  } catch {
    return undefined; // an address that was cut off or typed wrongly: the usual value
  }
}

/** @param {unknown} value @param {number} count */
function indexBelow(value, count) {
  return Number.isInteger(value) && Number(value) >= 0 && Number(value) < count ? Number(value) : 0;
}

/**
 * The scene of an address. Its camera is missing if the address has none.
 * @param {string} hash @param {Description} description
 * @returns {Omit<Scene, "camera"> & {camera?: Scene["camera"]}}
 */
export function sceneOf(hash, description) {
  const members = new URLSearchParams(hash.slice(1));
  const file = indexBelow(parsed(members.get("file")), description.files.length);
  const grid = indexBelow(parsed(members.get("grid")), description.files[file].grids.length);
  const scene = /** @type {Record<string, any>} */ (startOf(description, file, grid));
  for (const [name, isGood] of Object.entries(kChecks)) {
    const value = parsed(members.get(name));
    if (value !== undefined && isGood(value)) scene[name] = value;
  }
  const { frame, compare } = scene, { frames } = description.files[file];
  if (!frames.includes(frame)) scene.frame = frames[0] ?? null;
  if (compare && !description.files[compare.file]?.grids[compare.grid]) scene.compare = null;
  if (scene.clip && scene.slice) scene.slice = null; // a scene has one of them
  return /** @type {any} */ (scene);
}
