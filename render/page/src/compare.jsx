/**
 * Compares with another grid: the border over the picture, and the panel.
 * @typedef {import("./types.js").Description} Description
 * @typedef {import("./types.js").Scene} Scene
 */
import { follow } from "./browser.js";
import { NumberField, Section, SegmentedField, SelectField } from "./controls.jsx";
import { shortText } from "./text.js";

const kKeyStep = 0.02; // share of the width that an arrow key moves the border by

/**
 * The border between a volume and its reference.
 * @param {{share: number, left: string, right: string, onChange: (share: number) => void}} props
 */
export function Divider({ share, left, right, onChange }) {
  const move = (/** @type {number} */ to) => onChange(Math.min(1, Math.max(0, to)));
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    const area = /** @type {HTMLElement} */ (/** @type {HTMLElement} */ (event.currentTarget).parentElement);
    const { width, left: origin } = area.getBoundingClientRect();
    follow(event, (e) => move((e.clientX - origin) / width));
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ event) => {
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    move(share + sign * kKeyStep);
  };
  return (
    <div
      class="divider" style={{ left: `${100 * share}%` }} role="slider" tabindex={0}
      aria-label="Border between the volume and the reference" aria-valuenow={Math.round(100 * share)}
      aria-valuemin={0} aria-valuemax={100} aria-valuetext={`${Math.round(100 * share)} % of the width`}
      onPointerDown={onPointerDown} onKeyDown={onKeyDown}
    >
      <span class="side before">{left}</span><span class="grip" /><span class="side after">{right}</span>
    </div>
  );
}

const kNone = "none", kFirstGain = 10;

/** The grids that can be a reference: all but the one that is drawn. @param {Description} description @param {Scene} scene */
export function referencesOf(description, scene) {
  return description.files.flatMap((file, f) => file.grids.flatMap((grid, g) =>
    f === scene.file && g === scene.grid ? [] : [{ key: `${f}/${g}`, text: `${file.name}: ${grid.name}`, file: f, grid: g, frames: file.frames }]));
}

/** A comparison when another frame of the volume is drawn. @param {Scene["compare"]} compare @param {Description} description @param {number} frame */
export function compareAt(compare, description, frame) {
  if (!compare) return compare;
  const { frames } = description.files[compare.file];
  return { ...compare, frame: frames.includes(frame) ? frame : compare.frame };
}

/** The frame with which a reference begins: the one that is drawn, if it has it. */
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
