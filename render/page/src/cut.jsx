/**
 * Shows a part of the volume: the clip box over the picture, and the panel of clip boxes and slices.
 * @typedef {import("./types.js").Camera} Camera
 * @typedef {import("./types.js").Edges} Edges
 * @typedef {import("./types.js").Grid} Grid
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").Triple} Triple
 * @typedef {[Triple, Triple]} Box
 * @typedef {(place: Triple) => [number, number] | null} Projection
 */
import { follow } from "./browser.js";
import { projectionOf } from "./camera.js";
import { NumberField, Section, SegmentedField, SliderField } from "./controls.jsx";
import { edgesOf, kDefaults } from "./scene.js";
import { shortText } from "./text.js";

const kAxes = /** @type {const} */ (["x", "y", "z"]);
const kKeySteps = 100; // of the arrow keys along the volume
const kEdges = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/** @param {Box} box @param {number} index @returns {Triple} */
const cornerOf = (box, index) => [box[index & 1][0], box[(index >> 1) & 1][1], box[(index >> 2) & 1][2]];

/** The middle of a face. @param {Box} box @param {number} side  0: low, 1: high @param {number} axis @returns {Triple} */
function middleOf([low, high], side, axis) {
  const middle = /** @type {Triple} */ (low.map((v, i) => (v + high[i]) / 2));
  middle[axis] = (side ? high : low)[axis];
  return middle;
}

/** A box with a face at another place, between the other face and the volume's. @param {Box} box @param {Box} limits @returns {Box} */
function withFace(box, limits, side, axis, place) {
  const least = side ? box[0][axis] : limits[0][axis], most = side ? limits[1][axis] : box[1][axis];
  const corner = /** @type {Triple} */ (box[side].with(axis, Math.min(most, Math.max(least, place))));
  return side ? [box[0], corner] : [corner, box[1]];
}

/** Pixels of the picture for a voxel along an axis. @param {Projection} project @param {Triple} place */
function pixelsPerVoxel(project, place, axis) {
  const a = project(place), b = project(/** @type {Triple} */ (place.with(axis, place[axis] + 1)));
  return a && b ? [b[0] - a[0], b[1] - a[1]] : [0, 0];
}

/** A handle that moves a face. */
function Handle({ box, limits, side, axis, project, onChange }) {
  const middle = middleOf(box, side, axis), at = project(middle);
  if (!at) return null;
  const place = middle[axis];
  const move = (/** @type {number} */ to, /** @type {boolean} */ moving) => onChange(withFace(box, limits, side, axis, to), moving);
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    const [ux, uy] = pixelsPerVoxel(project, middle, axis), square = ux * ux + uy * uy;
    // A face that points at the viewer follows vertical moves instead.
    const along = (dx, dy) => (square > 1e-3 ? (dx * ux + dy * uy) / square : -dy / 4);
    follow(event, (e) => move(place + along(e.clientX - event.clientX, e.clientY - event.clientY), true));
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ event) => {
    const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    move(place + (sign * (limits[1][axis] - limits[0][axis])) / kKeySteps, true);
  };
  return (
    <g
      class={`clip-handle axis-${kAxes[axis]}`} transform={`translate(${at[0]},${at[1]})`} role="slider" tabindex={0}
      aria-label={`Clip box: ${side ? "upper" : "lower"} end of ${kAxes[axis]}`}
      aria-valuenow={place} aria-valuemin={limits[0][axis]} aria-valuemax={limits[1][axis]} aria-valuetext={shortText(place)}
      onPointerDown={onPointerDown} onKeyDown={onKeyDown}
    >
      <circle class="reach" r="16" /><circle class="dot" r="7" />
    </g>
  );
}

/**
 * The clip box over the picture, with a handle on each face.
 * @param {object} props
 * @param {Camera} props.camera
 * @param {{width: number, height: number}} props.size
 * @param {Edges | null} props.edges  of a voxel
 * @param {Box} props.clip
 * @param {Box} props.limits
 * @param {(clip: Box, moving: boolean) => void} props.onChange
 */
export function ClipHandles({ camera, size, edges, clip, limits, onChange }) {
  const project = projectionOf(camera, size, edges);
  const corners = Array.from({ length: 8 }, (_, i) => project(cornerOf(clip, i)));
  return (
    <svg class="overlay" width={size.width} height={size.height} role="group" aria-label="Clip box">
      {kEdges.map(([i, j]) => {
        const a = corners[i], b = corners[j];
        return a && b && <line key={`${i}-${j}`} x1={a[0]} y1={a[1]} x2={b[0]} y2={b[1]} />;
      })}
      {[0, 1].flatMap((side) => [0, 1, 2].map((axis) => (
        <Handle key={`${side}-${axis}`} box={clip} limits={limits} side={side} axis={axis} project={project} onChange={onChange} />
      )))}
    </svg>
  );
}

/** @type {[string, string][]} */
const kCuts = [["none", "Whole volume"], ["clip", "Clip box"], ["slice", "Slice"]];

/** @param {{scene: Scene, limits: any, onChange: (change: Partial<Scene>, moving?: boolean) => void}} props */
function ClipFields({ scene, limits, onChange }) {
  const clip = /** @type {NonNullable<Scene["clip"]>} */ (scene.clip);
  const set = (/** @type {number} */ side, /** @type {number} */ axis) => (/** @type {number} */ v) =>
    onChange({ clip: withFace(clip, limits, side, axis, v) });
  return (
    <>
      <p class="hint">Drag the handles in the picture, or enter places in voxels.</p>
      {kAxes.map((name, axis) => (
        <fieldset class="axis-fields" key={name}>
          <legend>{name.toUpperCase()}</legend>
          <NumberField label="from" value={clip[0][axis]} step={1} onChange={set(0, axis)} />
          <NumberField label="to" value={clip[1][axis]} step={1} onChange={set(1, axis)} />
        </fieldset>
      ))}
      <button type="button" onClick={() => onChange({ clip: limits })}>Reset the box</button>
    </>
  );
}

/** @param {{scene: Scene, limits: any, onChange: (change: Partial<Scene>, moving?: boolean) => void}} props */
function SliceFields({ scene, limits, onChange }) {
  const slice = /** @type {NonNullable<Scene["slice"]>} */ (scene.slice);
  const axis = kAxes.indexOf(slice.axis);
  const set = (/** @type {number} */ place, moving = false) => onChange({ slice: { ...slice, place } }, moving);
  const middle = (/** @type {number} */ i) => Math.round((limits[0][i] + limits[1][i]) / 2);
  return (
    <>
      <SegmentedField
        label="Perpendicular to" value={slice.axis} options={[["x", "X"], ["y", "Y"], ["z", "Z"]]}
        onChange={(name) => onChange({ slice: { axis: /** @type {any} */ (name), place: middle(kAxes.indexOf(/** @type {any} */ (name))) } })}
      />
      <div class="row">
        <SliderField label="Place of the slice" hideLabel value={slice.place} min={limits[0][axis]} max={limits[1][axis]} step={0.5} onChange={set} />
        <NumberField label="Place" value={slice.place} step={1} unit="voxels" onChange={set} />
      </div>
    </>
  );
}

/** The members of a scene for a kind of cut. */
function cutChange(kind, limits) {
  const slice = /** @type {const} */ ({ axis: "z", place: Math.round((limits[0][2] + limits[1][2]) / 2) });
  // Slices are drawn with the defaults of esvr-render for them.
  if (kind === "slice") return { clip: null, slice, classification: /** @type {const} */ ("post"), lod: /** @type {const} */ ("off") };
  const usual = { slice: null, classification: kDefaults.classification, lod: kDefaults.lod };
  return { ...usual, clip: kind === "clip" ? limits : null };
}

/**
 * Shows a part of the volume.
 * @param {object} props
 * @param {Scene} props.scene
 * @param {Grid} props.grid
 * @param {(change: Partial<Scene>, moving?: boolean) => void} props.onChange
 */
export function CutPanel({ scene, grid, onChange }) {
  const limits = edgesOf(grid);
  const kind = scene.clip ? "clip" : scene.slice ? "slice" : "none";
  return (
    <Section title="Cut" note={kind !== "none" && "on"}>
      <SegmentedField label="Show" value={kind} options={kCuts} onChange={(k) => onChange(cutChange(k, limits))} />
      {scene.clip && <ClipFields scene={scene} limits={limits} onChange={onChange} />}
      {scene.slice && <SliceFields scene={scene} limits={limits} onChange={onChange} />}
    </Section>
  );
}
