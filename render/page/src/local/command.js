/**
 * The command line that makes the same picture, as render/view/desk.cpp writes it.
 * @typedef {import("../types.js").Scene} Scene
 * @typedef {import("../types.js").Description} Description
 */
import { paraViewText } from "../paraview.js";
import { kDefaults } from "../scene.js";

const kTransferFile = "transfer.json";

/** A word of a POSIX shell. @param {string} text */
const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`);

/** @param {Scene} scene @param {Description} description */
function inputOf({ file, grid }, description) {
  const { name, grids } = description.files[file];
  return [name, "picture.png", ...(grids.length > 1 ? [`--grid=${grids[grid].name}`] : [])];
}

/** @param {Scene} scene */
function cameraOf({ camera: { eye, center, up, fov, height } }) {
  const places = [`--eye=${eye}`, `--center=${center}`, `--up=${up}`];
  return height === undefined ? [...places, `--fov=${fov ?? 30}`] : [...places, "--orthographic", `--height=${height}`];
}

/** @param {Scene} scene */
function cutOf({ clip, slice }) {
  if (slice) return [`--slice=${slice.axis}=${slice.place}`];
  return clip ? [`--clip=${clip.flat()}`] : [];
}

/** Options of the rays that differ from the defaults of esvr-render. @param {Scene} scene */
function raysOf({ opacityLength, step, mode, classification, lod, shade, background, slice }) {
  const post = classification === "post", off = lod === "off";
  const options = [
    opacityLength !== kDefaults.opacityLength && `--opacity-length=${opacityLength}`,
    step !== kDefaults.step && `--step=${step}`,
    mode !== kDefaults.mode && `--mode=${mode}`,
    post !== Boolean(slice) && `--classification=${classification}`,
    off !== Boolean(slice) && `--lod=${lod}`,
    "--between=voxels",
    shade && "--shade",
    background && `--background=${background}`,
  ];
  return options.filter((option) => typeof option === "string");
}

/** @param {{scene: Scene, width: number, height: number}} request @param {Description} description */
export function commandOf({ scene, width, height }, description) {
  const words = [
    "esvr-render", ...inputOf(scene, description), `--resolution=${width}x${height}`, ...cameraOf(scene),
    `--tf=${kTransferFile}`, "--range=own", ...raysOf(scene), ...cutOf(scene),
  ];
  return { text: words.map(quoted).join(" "), transfer: paraViewText(scene.transfer, "esvr-view") };
}
