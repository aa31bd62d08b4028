import { withParallelRays } from "./camera/orbit.js";
import { ColorBar } from "./picture/color-bar.jsx";
import { Picture } from "./picture/picture.jsx";
import { ViewButtons } from "./picture/view-buttons.jsx";
import { gridOf } from "./state/scene.js";

/**
 * The picture, and what lies over it.
 * @param {object} props
 * @param {import("./types.js").Description} props.description
 * @param {import("./types.js").Scene} props.scene
 * @param {boolean} props.moving
 * @param {ReturnType<typeof import("./parts/use-size.js").useSize>} props.area
 * @param {ReturnType<typeof import("./use-actions.js").actionsOf>} props.actions
 * @param {ReturnType<typeof import("./use-painting.js").usePainting>} props.painting
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
