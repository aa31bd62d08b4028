import { useEffect, useReducer, useState } from "preact/hooks";
import { Messages } from "./messages.jsx";
import { Panel } from "./panel.jsx";
import { usePresets } from "./panels/presets.jsx";
import { SequenceBar } from "./panels/sequence.jsx";
import { useSize } from "./parts/use-size.js";
import { Stage } from "./stage.jsx";
import { gridOf } from "./state/scene.js";
import { Toolbar } from "./toolbar.jsx";
import { actionsOf } from "./use-actions.js";
import { useAddress } from "./use-address.js";
import { useConnection } from "./use-connection.js";
import { usePainting } from "./use-painting.js";
import { usePlaying } from "./use-playing.js";
import { useHistogram } from "./use-volume.js";

const kMostPixels = 4096; // a side, as esvr-view allows
const kNothing = Object.freeze({ width: 0, height: 0 });

/** Pixels of the screen for an element. @param {{width: number, height: number}} size */
function pixelsOf({ width, height }) {
  const ratio = Math.min(devicePixelRatio || 1, kMostPixels / Math.max(width, height, 1));
  return { width: Math.round(width * ratio), height: Math.round(height * ratio) };
}

/** Draws again when the store changes. @param {import("./state/store.js").Store} store */
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

/** @param {string} grid @param {string} file */
function useTitle(grid, file) {
  useEffect(() => {
    document.title = `${grid} of ${file} – ESVR viewer`;
  }, [grid, file]);
}

/**
 * The page while a volume is shown.
 * @param {object} props
 * @param {import("./types.js").Backend} props.backend
 * @param {import("./types.js").Description} props.description
 * @param {import("./state/store.js").Store} props.store
 * @param {boolean} props.fitFirst  the address has no camera
 */
export function Viewer({ backend, description, store, fitFirst }) {
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
        {file.frames.length > 1 && backend.can.has("frames") && <SequenceBar {...player} playing={playing} onPlay={setPlaying} frames={file.frames} frame={scene.frame} onFrame={actions.setFrame} />}
      </main>
      <Panel
        backend={backend} description={description} scene={scene} histogram={histogram} actions={actions} presets={presets} painting={painting}
      />
    </div>
  );
}
