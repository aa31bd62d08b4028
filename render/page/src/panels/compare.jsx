import { shortText } from "../look/number-text.js";
import { SegmentedField, SelectField } from "../parts/fields.jsx";
import { NumberField } from "../parts/number-field.jsx";
import { Section } from "../parts/section.jsx";

/**
 * @typedef {import("../types.js").Scene} Scene
 * @typedef {import("../types.js").Description} Description
 */

const kNone = "none", kFirstGain = 10;

/** The grids that can be a reference: all but the one that is drawn. @param {Description} description @param {Scene} scene */
export function referencesOf(description, scene) {
  return description.files.flatMap((file, f) => file.grids.flatMap((grid, g) =>
    f === scene.file && g === scene.grid ? [] : [{ key: `${f}/${g}`, text: `${file.name}: ${grid.name}`, file: f, grid: g, frames: file.frames }]));
}

/** The frame of a reference that belongs to the frame that is drawn. */
function frameFor(frames, frame) {
  if (frames.length === 0) return null;
  return frames.includes(frame) ? frame : frames[0];
}

/**
 * Compares with another grid.
 * @param {object} props
 * @param {Scene} props.scene
 * @param {Description} props.description
 * @param {{psnr: number | null, maxDifference: number} | null} props.errors
 * @param {(change: Partial<Scene>, moving?: boolean) => void} props.onChange
 */
export function ComparePanel({ scene, description, errors, onChange }) {
  const references = referencesOf(description, scene);
  const { compare } = scene;
  const choose = (/** @type {string} */ key) => {
    const found = references.find((r) => r.key === key);
    const old = compare ?? { show: /** @type {const} */ ("split"), split: 0.5, gain: kFirstGain };
    onChange({ compare: found ? { ...old, file: found.file, grid: found.grid, frame: frameFor(found.frames, scene.frame) } : null });
  };
  const options = /** @type {[string, string][]} */ ([[kNone, "None"], ...references.map((r) => [r.key, r.text])]);
  return (
    <Section title="Compare" note={compare && "on"}>
      <SelectField label="Reference" value={compare ? `${compare.file}/${compare.grid}` : kNone} options={options} onChange={choose} />
      {compare && (
        <>
          <SegmentedField
            label="Show" value={compare.show} options={[["split", "Side by side"], ["reference", "Reference"], ["difference", "Difference"]]}
            onChange={(show) => onChange({ compare: { ...compare, show: /** @type {any} */ (show) } })}
          />
          {compare.show === "difference" && (
            <NumberField
              label="Difference multiplied by" value={compare.gain} min={0} max={1e6} step={1}
              onChange={(gain) => onChange({ compare: { ...compare, gain } })}
            />
          )}
          {errors && (
            <dl class="facts">
              <div><dt>PSNR of the picture</dt><dd>{errors.psnr === null ? "equal pictures" : `${errors.psnr.toFixed(2)} dB`}</dd></div>
              <div><dt>Largest difference</dt><dd>{shortText(255 * errors.maxDifference, 3)} of 255</dd></div>
            </dl>
          )}
        </>
      )}
    </Section>
  );
}
