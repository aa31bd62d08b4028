import { useEffect, useReducer, useRef, useState } from "preact/hooks";
import { withParallelRays } from "./camera/orbit.js";
import { Editor } from "./editor/editor.jsx";
import { ComparePanel, referencesOf } from "./panels/compare.jsx";
import { CutPanel } from "./panels/cut.jsx";
import { DrawingPanel } from "./panels/drawing.jsx";
import { PresetChoice, PresetFiles, usePresets } from "./panels/presets.jsx";
import { SequenceBar } from "./panels/sequence.jsx";
import { StatisticsPanel } from "./panels/statistics.jsx";
import { Section } from "./parts/section.jsx";
import { useSize } from "./parts/use-size.js";
import { ColorBar } from "./picture/color-bar.jsx";
import { Picture } from "./picture/picture.jsx";
import { ViewButtons } from "./picture/view-buttons.jsx";
import { gridOf, startOf } from "./state/scene.js";
import { hashOf, sceneOf } from "./state/link.js";
import { Toolbar } from "./toolbar.jsx";
import { usePainting } from "./use-painting.js";
import { usePlaying } from "./use-playing.js";
import { useHistogram } from "./use-volume.js";

/**
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").Description} Description
 * @typedef {import("./types.js").Backend} Backend
 */

const kMostPixels = 4096; // a side, as esvr-view allows
const kMessageMs = 6000;

/** Pixels of the screen for an element. */
function pixelsOf({ width, height }) {
  const ratio = Math.min(devicePixelRatio || 1, kMostPixels / Math.max(width, height, 1));
  return { width: Math.round(width * ratio), height: Math.round(height * ratio) };
}

/** Draws again when the store changes. @param {import("./state/store.js").Store} store */
function useStore(store) {
  const [, redraw] = useReducer((/** @type {number} */ n) => n + 1, 0);
  useEffect(() => store.subscribe(() => redraw(0)), []);
  return store;
}

/** Keeps the scene in the address, and takes it from there. */
function useAddress(store, description, onCameraless) {
  const { scene, moving } = store;
  useEffect(() => {
    if (!moving) history.replaceState(null, "", hashOf(scene, description));
  }, [scene, moving]);
  useEffect(() => {
    const listen = () => {
      const found = sceneOf(location.hash, description);
      if (found.camera) store.set(found);
      else onCameraless(found);
    };
    addEventListener("hashchange", listen);
    return () => removeEventListener("hashchange", listen);
  }, []);
}

/** Whether there is a connection, and how many there were. @param {Backend} backend */
function useConnection(backend) {
  const [state, setState] = useState({ open: true, count: 0 });
  useEffect(() => {
    backend.onConnection((open) => setState((old) => ({ open, count: old.count + (open && !old.open ? 1 : 0) })));
  }, []);
  return state;
}

/**
 * The page while a volume is shown.
 * @param {{backend: Backend, description: Description, store: import("./state/store.js").Store, fitFirst: boolean}} props
 */
export function Viewer({ backend, description, store, fitFirst }) {
  const { scene, moving } = useStore(store);
  const { ref: area, size } = useSize();
  const pixels = pixelsOf(size);
  const connection = useConnection(backend);
  const [toast, setToast] = useState("");
  const grid = gridOf(description, scene), file = description.files[scene.file];
  const painting = usePainting(backend, { scene, moving, size: pixels, connection: connection.count });
  const histogram = useHistogram(backend, grid, scene, !moving);
  useEffect(() => {
    document.title = `${grid.name} of ${file.name} – ESVR viewer`;
  }, [grid, file]);
  const set = (/** @type {Partial<Scene>} */ change, isMoving = false) => store.set(change, { moving: isMoving });

  const fit = async (view = "default", changes = /** @type {Partial<Scene>} */ ({})) => {
    const { file: f, grid: g, frame, camera } = { ...store.scene, ...changes };
    const orthographic = camera.height !== undefined;
    try {
      set({ ...changes, camera: await backend.fit({ file: f, grid: g, frame, ...pixels, view, orthographic }) });
    } catch (error) {
      setToast(/** @type {Error} */ (error).message);
    }
  };
  const fitted = useRef(!fitFirst);
  useEffect(() => {
    if (fitted.current || !size.width) return;
    fitted.current = true;
    fit();
  }, [size.width]);
  useAddress(store, description, (/** @type {Scene} */ found) => fit("default", found));
  const chooseGrid = (/** @type {number} */ f, /** @type {number} */ g) => fit("default", startOf(description, f, g));
  const setFrame = (/** @type {number} */ frame, isMoving = true) => {
    const { compare } = store.scene;
    const other = compare && description.files[compare.file].frames;
    set({ frame, compare: compare && { ...compare, frame: other?.includes(frame) ? frame : compare.frame } }, isMoving);
  };
  const player = usePlaying(file.frames, () => store.scene.frame, painting.shownFrame, setFrame);
  const setTransfer = (/** @type {Scene["transfer"]} */ transfer, isMoving = false) => set({ transfer }, isMoving);
  const presets = usePresets(backend, () => store.scene.transfer, setTransfer, setToast);
  const comparable = backend.can.has("compare") && referencesOf(description, scene).length > 0;
  const reference = scene.compare && description.files[scene.compare.file];
  return (
    <div class="viewer" {...presets.dropProps}>
      <Toolbar
        backend={backend} description={description} store={store} pixels={pixels} onGrid={chooseGrid} onMessage={setToast}
      />
      <main class="stage" aria-label="Picture">
        <Picture
          scene={scene} grid={grid} size={size} area={area} canvases={painting.canvases} onChange={set} onFit={() => fit()}
          busy={painting.busy} names={{ own: file.name, reference: reference?.name ?? "" }}
        >
          {painting.busy && !moving && <div class="progress" aria-hidden="true" />}
          {scene.compare?.show !== "difference" && <ColorBar transfer={scene.transfer} name={grid.name} unit={grid.unit} />}
          <ViewButtons
            camera={scene.camera} onView={fit}
            onParallel={(parallel) => set({ camera: withParallelRays(scene.camera, parallel) })}
          />
          <Messages failure={painting.failure} toast={toast} open={connection.open} onClose={() => setToast("")} />
        </Picture>
        {file.frames.length > 1 && <SequenceBar {...player} frames={file.frames} frame={scene.frame} onFrame={setFrame} />}
      </main>
      <aside class="panel" aria-label="Settings">
        <Section title="Colors and opacity" open>
          <Editor
            transfer={scene.transfer} description={description} grid={grid} histogram={histogram} onChange={setTransfer}
            files={<PresetFiles backend={backend} transfer={scene.transfer} name={grid.name} onOpen={presets.open} />}
          />
          {presets.opened && <PresetChoice opened={presets.opened} onChange={presets.show} />}
        </Section>
        <DrawingPanel scene={scene} grid={grid} can={backend.can} onChange={set} />
        <CutPanel scene={scene} grid={grid} onChange={set} />
        {comparable && <ComparePanel scene={scene} description={description} errors={painting.errors} onChange={set} />}
        <StatisticsPanel description={description} scene={scene} grid={grid} speed={painting.speed} />
      </aside>
    </div>
  );
}

/** @param {{failure: string, toast: string, open: boolean, onClose: () => void}} props */
function Messages({ failure, toast, open, onClose }) {
  useEffect(() => {
    if (!toast) return;
    const timer = setTimeout(onClose, kMessageMs);
    return () => clearTimeout(timer);
  }, [toast]);
  return (
    <div class="messages">
      <div role="alert">
        {!open && <p class="message error">The connection to esvr-view has ended. The page tries to connect again.</p>}
        {open && failure && <p class="message error">{failure}</p>}
      </div>
      <div role="status">{toast && <p class="message">{toast}</p>}</div>
    </div>
  );
}
