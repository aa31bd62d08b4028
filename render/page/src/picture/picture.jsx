import { useEffect, useRef } from "preact/hooks";
import { edgesOf } from "../state/scene.js";
import { ClipHandles } from "./clip-handles.jsx";
import { Divider } from "./divider.jsx";
import { listenToGestures } from "./gestures.js";

const kLabel =
  "Picture of the volume. Arrow keys turn it, Shift and arrow keys shift it, plus and minus zoom, 0 shows all of it.";

/**
 * The picture, and what can be dragged in it.
 * @param {object} props
 * @param {import("../types.js").Scene} props.scene
 * @param {import("../types.js").Grid} props.grid
 * @param {{width: number, height: number}} props.size
 * @param {any} props.area  ref of the element
 * @param {{main: any, reference: any}} props.canvases  refs
 * @param {(change: Partial<import("../types.js").Scene>, moving: boolean) => void} props.onChange
 * @param {() => void} props.onFit
 * @param {boolean} props.busy  the picture is not complete
 * @param {{own: string, reference: string}} props.names
 * @param {any} props.children
 */
export function Picture({ scene, grid, size, area, canvases, onChange, onFit, busy, names, children }) {
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
