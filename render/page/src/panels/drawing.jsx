import { hexOf, tripleOf } from "../look/css-color.js";
import { CheckField, SelectField } from "../parts/fields.jsx";
import { NumberField } from "../parts/number-field.jsx";
import { Section } from "../parts/section.jsx";

const kBlack = /** @type {import("../types.js").Triple} */ ([0, 0, 0]);
/** @type {[string, string][]} */
const kModes = [
  ["composite", "Colors and opacities along each ray"],
  ["maximum", "Largest value on each ray"],
  ["average", "Mean value on each ray"],
];
/** @type {[string, string][]} */
const kClassifications = [["pre", "Smooth: colors integrated between samples"], ["post", "Color of each sample alone"]];
/** @type {[string, string][]} */
const kLevels = [["auto", "Fewer, larger voxels where pixels are larger"], ["off", "Full voxels everywhere"]];
/** @type {[string, string][]} */
const kBetween = [["voxels", "Interpolate decoded voxels"], ["sum", "Add up the ellipsoids exactly"]];

/** @param {{scene: import("../types.js").Scene, onChange: (change: Partial<import("../types.js").Scene>, moving?: boolean) => void}} props */
function Background({ scene, onChange }) {
  return (
    <div class="row">
      <label class="field">
        <span>Background</span>
        <input
          type="color" value={hexOf(scene.background ?? kBlack)}
          onInput={(e) => onChange({ background: tripleOf(e.currentTarget.value) }, true)}
        />
      </label>
      <CheckField
        label="Transparent in PNG files" checked={scene.background === null}
        hint="The page shows a transparent background as black"
        onChange={(on) => onChange({ background: on ? null : kBlack })}
      />
    </div>
  );
}

/**
 * How rays turn values into a picture.
 * @param {object} props
 * @param {import("../types.js").Scene} props.scene
 * @param {import("../types.js").Grid} props.grid
 * @param {Set<string>} props.can
 * @param {(change: Partial<import("../types.js").Scene>, moving?: boolean) => void} props.onChange
 */
export function DrawingPanel({ scene, grid, can, onChange }) {
  const select = (/** @type {keyof typeof scene} */ name) => (/** @type {string} */ value) => onChange({ [name]: value });
  return (
    <Section title="Rendering">
      <SelectField stacked label="Show" value={scene.mode} options={kModes} onChange={select("mode")} />
      <div class="grid">
        <NumberField
          label="Opacity length" value={scene.opacityLength} min={1e-6} max={1e6} unit="voxels"
          step={scene.opacityLength / 10} onChange={(v) => onChange({ opacityLength: v })}
          hint="A constant value reaches its opacity over this length. A larger length makes the volume more transparent."
        />
        <NumberField
          label="Step along a ray" value={scene.step} min={0.05} max={64} step={0.1} unit="voxels" onChange={(v) => onChange({ step: v })}
          hint="Distance between samples. Smaller steps are slower and more exact."
        />
      </div>
      {can.has("shade") && (
        <CheckField label="Light surfaces from the upper left" checked={scene.shade} onChange={(shade) => onChange({ shade })} />
      )}
      <Background scene={scene} onChange={onChange} />
      {can.has("classification") && (
        <SelectField stacked label="Colors between samples" value={scene.classification} options={kClassifications} onChange={select("classification")} />
      )}
      {can.has("lod") && <SelectField stacked label="Levels of detail" value={scene.lod} options={kLevels} onChange={select("lod")} />}
      {can.has("between") && grid.kind === "ellipsoids" && (
        <SelectField stacked label="Values between voxels" value={scene.between} options={kBetween} onChange={select("between")} />
      )}
    </Section>
  );
}
