import { Editor } from "./editor/editor.jsx";
import { ComparePanel, referencesOf } from "./panels/compare.jsx";
import { CutPanel } from "./panels/cut.jsx";
import { DrawingPanel } from "./panels/drawing.jsx";
import { PresetChoice, PresetFiles } from "./panels/presets.jsx";
import { StatisticsPanel } from "./panels/statistics.jsx";
import { Section } from "./parts/section.jsx";
import { gridOf } from "./state/scene.js";

/**
 * The settings beside the picture.
 * @param {object} props
 * @param {import("./types.js").Backend} props.backend
 * @param {import("./types.js").Description} props.description
 * @param {import("./types.js").Scene} props.scene
 * @param {import("./types.js").Histogram | null} props.histogram
 * @param {ReturnType<typeof import("./use-actions.js").actionsOf>} props.actions
 * @param {ReturnType<typeof import("./panels/presets.jsx").usePresets>} props.presets
 * @param {ReturnType<typeof import("./use-painting.js").usePainting>} props.painting
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
