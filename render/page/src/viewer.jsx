/**
 * The page: starts with the scene of the address, and keeps picture, panel and address in step with it.
 * @typedef {import("./types.js").Backend} Backend
 * @typedef {import("./types.js").Description} Description
 * @typedef {import("./types.js").Grid} Grid
 * @typedef {import("./types.js").Histogram} Histogram
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {ReturnType<typeof actionsOf>} Actions  what the controls do with the scene
 */
import { render } from "preact";
import { useEffect, useReducer, useRef, useState } from "preact/hooks";
import { applyTheme, storedTheme, useSize } from "./browser.js";
import { compareAt } from "./compare.jsx";
import { usePainting } from "./painter.js";
import { Panel } from "./panel.jsx";
import { Messages, SequenceBar, Stage, usePlaying } from "./picture.jsx";
import { usePresets } from "./presets.jsx";
import { gridOf, hashOf, kMostPixels, sceneOf, startOf, Store } from "./scene.js";
import { Toolbar } from "./toolbar.jsx";

/**
 * What the controls do with the scene.
 * @param {object} with_
 * @param {Backend} with_.backend
 * @param {Description} with_.description
 * @param {Store} with_.store
 * @param {{width: number, height: number}} with_.pixels  of the picture
 * @param {(text: string) => void} with_.onMessage
 */
function actionsOf({ backend, description, store, pixels, onMessage }) {
  const set = (/** @type {Partial<Scene>} */ change, moving = false) => store.set(change, { moving });
  const fit = async (view = "default", change = /** @type {Partial<Scene>} */ ({})) => {
    const { file, grid, frame, camera } = { ...store.scene, ...change };
    const orthographic = camera.height !== undefined;
    try {
      set({ ...change, camera: await backend.fit({ file, grid, frame, ...pixels, view, orthographic }) });
    } catch (error) {
      onMessage(/** @type {Error} */ (error).message);
    }
  };
  return {
    set,
    fit,
    setTransfer: (/** @type {Scene["transfer"]} */ transfer, moving = false) => set({ transfer }, moving),
    chooseGrid: (/** @type {number} */ file, /** @type {number} */ grid) => fit("default", startOf(description, file, grid)),
    setFrame: (/** @type {number} */ frame, moving = true) =>
      set({ frame, compare: compareAt(store.scene.compare, description, frame) }, moving),
  };
}

/**
 * Keeps the scene in the address, and takes it from there when the user changes it.
 * @param {Store} store @param {Description} description
 * @param {(scene: Omit<Scene, "camera">) => void} onWithoutCamera  for addresses that have none
 */
function useAddress(store, description, onWithoutCamera) {
  const { scene, moving } = store;
  const latest = useRef(onWithoutCamera);
  latest.current = onWithoutCamera; // the listener lives as long as the page
  useEffect(() => {
    if (!moving) history.replaceState(null, "", hashOf(scene, description));
  }, [scene, moving]);
  useEffect(() => {
    const listen = () => {
      const { camera, ...found } = sceneOf(location.hash, description);
      if (camera) store.set({ ...found, camera });
      else latest.current(found);
    };
    addEventListener("hashchange", listen);
    return () => removeEventListener("hashchange", listen);
  }, []);
}

/**
 * Whether there is a connection, and how many there were before.
 * @param {Backend} backend
 */
function useConnection(backend) {
  const [state, setState] = useState({ open: true, count: 0 });
  useEffect(() => {
    backend.onConnection((open) => setState((old) => ({ open, count: old.count + (open && !old.open ? 1 : 0) })));
  }, []);
  return state;
}

/**
 * The histogram of a grid; null until it is there.
 * @param {Backend} backend @param {Grid} grid
 * @param {Scene} scene @param {boolean} still  the scene does not move
 * @returns {Histogram | null}
 */
function useHistogram(backend, grid, { file, grid: index, frame }, still) {
  const [histogram, setHistogram] = useState(grid.histogram);
  const asked = useRef("");
  useEffect(() => {
    const place = `${file}/${index}/${frame}`;
    if (!still || grid.histogram || asked.current === place) return;
    asked.current = place;
    const show = (/** @type {Histogram | null} */ found) => asked.current === place && setHistogram(found);
    // The editor works without one.
    backend.histogram({ file, grid: index, frame }).then(show, () => show(null));
  }, [file, index, frame, still]);
  return grid.histogram ?? histogram;
}

const kNothing = Object.freeze({ width: 0, height: 0 });

/** Pixels of the screen for an element. @param {{width: number, height: number}} size */
function pixelsOf({ width, height }) {
  const ratio = Math.min(devicePixelRatio || 1, kMostPixels / Math.max(width, height, 1));
  return { width: Math.round(width * ratio), height: Math.round(height * ratio) };
}

/** Draws again when the store changes. @param {Store} store */
function useStore(store) {
  const [, redraw] = useReducer((/** @type {number} */ n) => n + 1, 0);
  useEffect(() => store.subscribe(() => redraw(0)), []);
}

/**
 * Fits the first camera to the picture's size, which is not known before.
 * @param {boolean} wanted @param {number} width @param {() => Promise<void>} fit
 * @returns {boolean} whether there is something to draw
 */
function useFirstFit(wanted, width, fit) {
  const [ready, setReady] = useState(!wanted);
  useEffect(() => {
    if (!ready && width > 0) fit().then(() => setReady(true));
  }, [width > 0]);
  return ready;
}

/** Names the window. @param {string} grid @param {string} file */
function useTitle(grid, file) {
  useEffect(() => {
    document.title = `${grid} of ${file} – ESVR viewer`;
  }, [grid, file]);
}

/**
 * The page while a volume is shown.
 * @param {object} props
 * @param {Backend} props.backend
 * @param {Description} props.description
 * @param {Store} props.store
 * @param {boolean} props.fitFirst  the address has no camera
 */
function Viewer({ backend, description, store, fitFirst }) {
  useStore(store);
  const [message, setMessage] = useState("");
  const area = useSize(), pixels = pixelsOf(area.size);
  const connection = useConnection(backend);
  const [playing, setPlaying] = useState(false);
  const { scene } = store, moving = store.moving || playing;
  const file = description.files[scene.file], grid = gridOf(description, scene);
  const actions = actionsOf({ backend, description, store, pixels, onMessage: setMessage });
  const ready = useFirstFit(fitFirst, area.size.width, actions.fit);
  const painting = usePainting(backend, { scene, moving, size: ready ? pixels : kNothing, connection: connection.count });
  const histogram = useHistogram(backend, grid, scene, !moving);
  const player = usePlaying(playing, file.frames, () => store.scene.frame, painting.shownFrame, actions.setFrame);
  const presets = usePresets(backend, () => store.scene.transfer, actions.setTransfer, setMessage);
  useAddress(store, description, (found) => actions.fit("default", found));
  useTitle(grid.name, file.name);
  return (
    <div class="viewer" {...presets.dropProps}>
      <Toolbar
        backend={backend} description={description} store={store} pixels={pixels} onGrid={actions.chooseGrid} onMessage={setMessage}
      />
      <main class="stage" aria-label="Picture">
        <Stage description={description} scene={scene} moving={moving} area={area} actions={actions} painting={painting}>
          <Messages failure={painting.failure} message={message} open={connection.open} onClose={() => setMessage("")} />
        </Stage>
        {file.frames.length > 1 && backend.can.has("frames") && (
          <SequenceBar
            {...player} playing={playing} onPlay={setPlaying} frames={file.frames} frame={scene.frame} onFrame={actions.setFrame}
          />
        )}
      </main>
      <Panel
        backend={backend} description={description} scene={scene} histogram={histogram} actions={actions} presets={presets} painting={painting}
      />
    </div>
  );
}

/** The size for which the first camera is fitted: most of the window is the picture. */
const firstSize = () => ({ width: Math.max(1, innerWidth), height: Math.max(1, innerHeight) });

/** What there is to see, and the scene of the address. @param {Backend} backend */
async function begin(backend) {
  const description = await backend.describe();
  const { camera, ...scene } = sceneOf(location.hash, description);
  const { file, grid, frame } = scene;
  const usual = () => backend.fit({ file, grid, frame, ...firstSize(), view: "default", orthographic: false });
  const store = new Store({ ...scene, camera: camera ?? (await usual()) });
  return { description, store, fitFirst: camera === undefined };
}

/** The page from its opening on. @param {{backend: Backend}} props */
function Page({ backend }) {
  const [started, setStarted] = useState(/** @type {Awaited<ReturnType<typeof begin>> | null} */ (null));
  const [error, setError] = useState("");
  useEffect(() => {
    begin(backend).then(setStarted, (e) => setError(e.message));
  }, []);
  if (started) return <Viewer backend={backend} {...started} />;
  return (
    <main class="starting">
      {error ? <p role="alert">{error}</p> : <p role="status">Opening the volume…</p>}
    </main>
  );
}

/** @param {Backend} backend */
export function startPage(backend) {
  const root = /** @type {HTMLElement} */ (document.getElementById("page"));
  applyTheme(storedTheme());
  root.replaceChildren();
  render(<Page backend={backend} />, root);
}
