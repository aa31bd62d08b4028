/**
 * The picture, what lies over it, and the sequence below it.
 * @typedef {import("./types.js").Camera} Camera
 * @typedef {import("./types.js").Description} Description
 * @typedef {import("./types.js").Grid} Grid
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").Transfer} Transfer
 * @typedef {import("./viewer.jsx").Actions} Actions
 * @typedef {import("./painter.js").Painting} Painting
 * @typedef {import("./browser.js").Area} Area
 */
import { useEffect, useRef, useState } from "preact/hooks";
import { withParallelRays } from "./camera.js";
import { Divider } from "./compare.jsx";
import { Icon, SelectField, SliderField } from "./controls.jsx";
import { ClipHandles } from "./cut.jsx";
import { rampStyle } from "./editor/colors.jsx";
import { listenToGestures } from "./gestures.js";
import { edgesOf, gridOf } from "./scene.js";
import { shortText } from "./text.js";
import { rangeOf } from "./transfer.js";

/**
 * The meaning of the colors, over the picture.
 * @param {{transfer: Transfer, name: string, unit: string}} props
 */
function ColorBar({ transfer, name, unit }) {
  const [low, high] = rangeOf(transfer), middle = (low + high) / 2;
  return (
    <figure class="color-bar">
      <figcaption>{name}{unit && ` (${unit})`}</figcaption>
      <span class="ramp" style={rampStyle(transfer, [low, high])} />
      <span class="ends"><span>{shortText(low)}</span><span>{shortText(middle)}</span><span>{shortText(high)}</span></span>
    </figure>
  );
}

const kViews = [["+x", "+X"], ["-x", "−X"], ["+y", "+Y"], ["-y", "−Y"], ["+z", "+Z"], ["-z", "−Z"]];

/**
 * @param {object} props
 * @param {Camera} props.camera
 * @param {(view?: string) => void} props.onView
 * @param {(parallel: boolean) => void} props.onParallel
 */
function ViewButtons({ camera, onView, onParallel }) {
  const parallel = camera.height !== undefined;
  return (
    <div class="view-buttons" role="group" aria-label="Views">
      <button type="button" onClick={() => onView()} title="Show all of the volume (key 0)">Fit</button>
      {kViews.map(([view, text]) => (
        <button key={view} type="button" aria-label={`View from ${text}`} title={`View from ${text}`} onClick={() => onView(view)}>
          {text}
        </button>
      ))}
      <button
        type="button" aria-pressed={parallel} onClick={() => onParallel(!parallel)}
        title="Parallel rays: no perspective, so that equal lengths look equal"
      >
        Parallel
      </button>
    </div>
  );
}

const kMessageMs = 6000; // that a message is shown

/**
 * What went wrong, and what was done.
 * @param {object} props
 * @param {string} props.failure  why the scene is not drawn
 * @param {string} props.message
 * @param {boolean} props.open  there is a connection
 * @param {() => void} props.onClose
 */
export function Messages({ failure, message, open, onClose }) {
  useEffect(() => {
    if (!message) return;
    const timer = setTimeout(onClose, kMessageMs);
    return () => clearTimeout(timer);
  }, [message]);
  return (
    <div class="messages">
      <div role="alert">
        {!open && <p class="message error">The connection to esvr-view has ended. The page tries to connect again.</p>}
        {open && failure && <p class="message error">{failure}</p>}
      </div>
      <div role="status">{message && <p class="message">{message}</p>}</div>
    </div>
  );
}

const kLabel =
  "Picture of the volume. Arrow keys turn it, Shift and arrow keys shift it, plus and minus zoom, 0 shows all of it.";

/**
 * The picture, and what can be dragged in it.
 * @param {object} props
 * @param {Scene} props.scene
 * @param {Grid} props.grid
 * @param {{width: number, height: number}} props.size
 * @param {any} props.area  ref of the element
 * @param {{main: any, reference: any}} props.canvases  refs
 * @param {(change: Partial<Scene>, moving: boolean) => void} props.onChange
 * @param {() => void} props.onFit
 * @param {boolean} props.busy  the picture is not complete
 * @param {{own: string, reference: string}} props.names
 * @param {any} props.children
 */
function Picture({ scene, grid, size, area, canvases, onChange, onFit, busy, names, children }) {
  const surface = useRef(/** @type {any} */ (null));
  const target = useRef(/** @type {any} */ (null));
  target.current = { scene, onChange, onFit };
  useEffect(() => listenToGestures(surface.current, {
    camera: () => target.current.scene.camera,
    move: (camera) => {
      // Events may come faster than the page is drawn again.
      target.current.scene = { ...target.current.scene, camera };
      target.current.onChange({ camera }, true);
    },
    fit: () => target.current.onFit(),
  }), []);
  const split = scene.compare?.show === "split" ? scene.compare : null;
  return (
    <div class="picture" ref={area} aria-busy={busy}>
      <div class="surface" ref={surface} tabindex={0} role="application" aria-label={kLabel}>
        <canvas ref={canvases.main} aria-hidden="true" />
        <canvas
          ref={canvases.reference} hidden aria-hidden="true"
          style={{ clipPath: `inset(0 0 0 ${100 * (split?.split ?? 0)}%)` }}
        />
      </div>
      {split && (
        <Divider
          share={split.split} left={names.own} right={names.reference}
          onChange={(share) => onChange({ compare: { ...split, split: share } }, true)}
        />
      )}
      {scene.clip && size.width > 0 && (
        <ClipHandles
          camera={scene.camera} size={size} edges={grid.edges} clip={scene.clip} limits={edgesOf(grid)}
          onChange={(clip, moving) => onChange({ clip }, moving)}
        />
      )}
      {children}
    </div>
  );
}

/**
 * The picture, and what lies over it.
 * @param {object} props
 * @param {Description} props.description
 * @param {Scene} props.scene
 * @param {boolean} props.moving
 * @param {Area} props.area
 * @param {Actions} props.actions
 * @param {Painting} props.painting
 * @param {any} props.children
 */
export function Stage({ description, scene, moving, area, actions, painting, children }) {
  const { set, fit } = actions;
  const { files } = description, grid = gridOf(description, scene);
  const names = { own: files[scene.file].name, reference: scene.compare ? files[scene.compare.file].name : "" };
  return (
    <Picture
      scene={scene} grid={grid} size={area.size} area={area.ref} canvases={painting.canvases} onChange={set} onFit={() => fit()}
      busy={painting.busy} names={names}
    >
      {painting.busy && !moving && <div class="progress" aria-hidden="true" />}
      {scene.compare?.show !== "difference" && <ColorBar transfer={scene.transfer} name={grid.name} unit={grid.unit} />}
      <ViewButtons
        camera={scene.camera} onView={fit}
        onParallel={(parallel) => set({ camera: withParallelRays(scene.camera, parallel) })}
      />
      {children}
    </Picture>
  );
}

/**
 * Plays a sequence: the next frame comes after a time, but not before the present one was shown.
 * @param {boolean} playing
 * @param {number[]} frames
 * @param {() => number | null} frame  the present one
 * @param {{current: number | null | undefined}} shownFrame
 * @param {(frame: number) => void} onFrame
 */
export function usePlaying(playing, frames, frame, shownFrame, onFrame) {
  const [speed, setSpeed] = useState(12);
  useEffect(() => {
    if (!playing) return;
    const advance = () => {
      const present = frame();
      if (present === null || shownFrame.current !== present) return;
      onFrame(frames[(frames.indexOf(present) + 1) % frames.length]);
    };
    const timer = setInterval(advance, 1000 / speed);
    return () => clearInterval(timer);
  }, [playing, speed, frames]);
  return { speed, onSpeed: setSpeed };
}

/** @type {[string, string][]} */
const kSpeeds = [["6", "6 per second"], ["12", "12 per second"], ["24", "24 per second"], ["30", "30 per second"]];

/**
 * Chooses a frame of a sequence, or plays it.
 * @param {object} props
 * @param {number[]} props.frames
 * @param {number | null} props.frame
 * @param {boolean} props.playing
 * @param {number} props.speed
 * @param {(frame: number, moving: boolean) => void} props.onFrame
 * @param {(playing: boolean) => void} props.onPlay
 * @param {(speed: number) => void} props.onSpeed
 */
export function SequenceBar({ frames, frame, playing, speed, onFrame, onPlay, onSpeed }) {
  const index = Math.max(0, frames.indexOf(frame ?? frames[0]));
  const step = (/** @type {number} */ by) => onFrame(frames[(index + by + frames.length) % frames.length], false);
  return (
    <div class="sequence" role="group" aria-label="Sequence">
      <button type="button" class="icon" aria-label="Frame before" title="Frame before" onClick={() => step(-1)}><Icon name="back" /></button>
      <button type="button" class="icon" aria-label={playing ? "Pause" : "Play"} title={playing ? "Pause" : "Play"} onClick={() => onPlay(!playing)}>
        <Icon name={playing ? "pause" : "play"} />
      </button>
      <button type="button" class="icon" aria-label="Next frame" title="Next frame" onClick={() => step(1)}><Icon name="next" /></button>
      <SliderField
        label="Frame" hideLabel value={index} min={0} max={frames.length - 1} step={1} text={`frame ${frames[index]}`}
        onChange={(i, moving) => onFrame(frames[i], moving)}
      />
      <output>Frame {frames[index]} <span class="unit">({frames[0]} to {frames[frames.length - 1]})</span></output>
      <SelectField label="Speed" hideLabel value={String(speed)} options={kSpeeds} onChange={(v) => onSpeed(Number(v))} />
    </div>
  );
}
