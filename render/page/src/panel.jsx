/**
 * The settings beside the picture.
 * @typedef {import("./types.js").Backend} Backend
 * @typedef {import("./types.js").Description} Description
 * @typedef {import("./types.js").Grid} Grid
 * @typedef {import("./types.js").Histogram} Histogram
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").Triple} Triple
 * @typedef {import("./viewer.jsx").Actions} Actions
 * @typedef {import("./painter.js").Painting} Painting
 * @typedef {import("./presets.jsx").OpenedPresets} OpenedPresets
 */
import { ComparePanel, referencesOf } from "./compare.jsx";
import { CheckField, NumberField, Section, SelectField } from "./controls.jsx";
import { CutPanel } from "./cut.jsx";
import { Editor } from "./editor/editor.jsx";
import { PresetChoice, PresetFiles } from "./presets.jsx";
import { gridOf } from "./scene.js";
import { bytesText, countText, hexOf, shortText, tripleOf } from "./text.js";

const kBlack = /** @type {Triple} */ ([0, 0, 0]);
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

/** @param {{scene: Scene, onChange: (change: Partial<Scene>, moving?: boolean) => void}} props */
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
 * @param {Scene} props.scene
 * @param {Grid} props.grid
 * @param {Set<string>} props.can
 * @param {(change: Partial<Scene>, moving?: boolean) => void} props.onChange
 */
function DrawingPanel({ scene, grid, can, onChange }) {
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

/** @param {Grid} grid */
const sizeText = ({ box: [low, high] }) => low.map((v, i) => high[i] - v + 1).join(" × ");

/**
 * @param {object} props
 * @param {Description} props.description
 * @param {Scene} props.scene
 * @param {Grid} props.grid
 * @param {{fps: number | null, drawMs: number, ms: number, vramBytes: number, width: number, height: number, level: number} | null} props.speed
 */
function StatisticsPanel({ description, scene, grid, speed }) {
  const facts = [
    ["Stored as", { ellipsoids: "ellipsoids", voxels: "compressed voxels", vdb: "VDB voxels" }[grid.kind]],
    ["Ellipsoids", grid.ellipsoids > 0 && countText(grid.ellipsoids)],
    ["Bytes of the grid", bytesText(grid.bytes)],
    ["Bytes of the file", bytesText(description.files[scene.file].bytes)],
    ["Active voxels", countText(grid.activeVoxels)],
    ["Size in voxels", sizeText(grid)],
    ["Transform", grid.edges === null && "a frustum, which is not applied; voxels are drawn as cubes"],
    ["Class", grid.class],
    ["Values", `${grid.range.map((v) => shortText(v)).join(" to ")}${grid.unit && " " + grid.unit}`],
    ["Pictures per second while moving", speed?.fps && shortText(speed.fps, 3)],
    ["Time to draw the last picture", speed && `${shortText(speed.drawMs, 3)} ms`],
    ["Time until it was shown", speed && `${shortText(speed.ms, 3)} ms`],
    ["Pixels of the last picture", speed && `${speed.width} × ${speed.height}`],
    ["Memory of the GPU", speed && speed.vramBytes > 0 && bytesText(speed.vramBytes)],
    ["Drawn from", speed && speed.level > 0 && `means of ${2 ** speed.level} × ${2 ** speed.level} × ${2 ** speed.level} voxels`],
    ["Not drawn, because only OpenVDB reads them", description.carried?.join(", ")],
    ["Drawn on", description.device],
    ["Program", description.program],
  ];
  return (
    <Section title="Statistics">
      <dl class="facts">
        {facts.filter(([, value]) => value).map(([name, value]) => <div key={name}><dt>{name}</dt><dd>{value}</dd></div>)}
      </dl>
    </Section>
  );
}

/**
 * The settings beside the picture.
 * @param {object} props
 * @param {Backend} props.backend
 * @param {Description} props.description
 * @param {Scene} props.scene
 * @param {Histogram | null} props.histogram
 * @param {Actions} props.actions
 * @param {OpenedPresets} props.presets
 * @param {Painting} props.painting
 */
export function Panel({ backend, description, scene, histogram, actions, presets, painting }) {
  const grid = gridOf(description, scene), { set, setTransfer } = actions;
  const comparable = backend.can.has("compare") && referencesOf(description, scene).length > 0;
  const files = <PresetFiles backend={backend} transfer={scene.transfer} name={grid.name} onOpen={presets.open} />;
  return (
    <aside class="panel" aria-label="Settings">
      <Section title="Colors and opacity" open>
        <Editor
          key={`${scene.file}/${scene.grid}`} transfer={scene.transfer} description={description} grid={grid} histogram={histogram}
          onChange={setTransfer} files={files}
        />
        {presets.opened && <PresetChoice opened={presets.opened} onChange={presets.show} />}
      </Section>
      <DrawingPanel scene={scene} grid={grid} can={backend.can} onChange={set} />
      <CutPanel scene={scene} grid={grid} onChange={set} />
      {comparable && <ComparePanel scene={scene} description={description} errors={painting.errors} onChange={set} />}
      <StatisticsPanel description={description} scene={scene} grid={grid} speed={painting.speed} />
    </aside>
  );
}
