import { SegmentedField, SliderField } from "../parts/fields.jsx";
import { NumberField } from "../parts/number-field.jsx";
import { Section } from "../parts/section.jsx";
import { withFace } from "../picture/clip-handles.jsx";
import { edgesOf, kDefaults } from "../state/scene.js";

/** @typedef {import("../types.js").Scene} Scene */

const kAxes = /** @type {const} */ (["x", "y", "z"]);
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
 * @param {import("../types.js").Grid} props.grid
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
