import { bytesText, countText, shortText } from "../look/number-text.js";
import { Section } from "../parts/section.jsx";

/** @param {import("../types.js").Grid} grid */
const sizeText = ({ box: [low, high] }) => low.map((v, i) => high[i] - v + 1).join(" × ");

/**
 * @param {object} props
 * @param {import("../types.js").Description} props.description
 * @param {import("../types.js").Scene} props.scene
 * @param {import("../types.js").Grid} props.grid
 * @param {{fps: number | null, drawMs: number, ms: number, vramBytes: number, width: number, height: number, level: number} | null} props.speed
 */
export function StatisticsPanel({ description, scene, grid, speed }) {
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
