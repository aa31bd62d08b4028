import { projectionOf } from "../camera/projection.js";
import { shortText } from "../look/number-text.js";
import { follow } from "../parts/drag.js";

/**
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {[Triple, Triple]} Box
 * @typedef {(place: Triple) => [number, number] | null} Projection
 */

const kAxes = ["x", "y", "z"];
const kSteps = 100; // of the arrow keys along the volume
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
export function withFace(box, limits, side, axis, place) {
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
    move(place + (sign * (limits[1][axis] - limits[0][axis])) / kSteps, true);
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
 * @param {import("../types.js").Camera} props.camera
 * @param {{width: number, height: number}} props.size
 * @param {import("../types.js").Edges | null} props.edges  of a voxel
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
