import { useState } from "preact/hooks";
import { colorMapName, curveName, rangeOf, withColorMap, withCurve, withInvertedColors } from "../look/transfer.js";
import { SegmentedField, SelectField } from "../parts/fields.jsx";
import { ColorPoints } from "./color-points.jsx";
import { MapChooser, titleOf } from "./map-chooser.jsx";
import { Plot } from "./plot.jsx";
import { PointFields } from "./point-fields.jsx";
import { RangeFields } from "./range-fields.jsx";

/** @typedef {import("../look/transfer.js").Range} Range */

const kCustom = ""; // the name of what is from no list

/** The values of the data and of the transfer function. @param {Range} data @param {Range} range @returns {Range} */
const fullRange = (data, range) => [Math.min(data[0], range[0]), Math.max(data[1], range[1])];

/** Shows a part of the axis that is smaller by a factor. @param {Range} shown @param {Range} full @returns {Range | null} */
function zoomedRange(shown, full, factor, value) {
  const share = (value - shown[0]) / (shown[1] - shown[0]);
  const extent = (shown[1] - shown[0]) / factor;
  if (extent >= full[1] - full[0]) return null;
  const low = Math.min(Math.max(full[0], value - share * extent), full[1] - extent);
  return [low, low + extent];
}

/** @type {[string, string][]} */
const kCountScales = [["linear", "Linear"], ["log", "Log"]];
/** @type {[string, string][]} */
const kOpacityScales = [["linear", "Linear"], ["fine", "Fine near 0"]];

/**
 * How the axes of the diagram are divided.
 * @param {object} props
 * @param {string} props.countScale
 * @param {string} props.opacityScale
 * @param {boolean} props.zoomed
 * @param {(scale: string) => void} props.onCountScale
 * @param {(scale: string) => void} props.onOpacityScale
 * @param {(factor: number) => void} props.onZoom
 */
function AxisFields({ countScale, opacityScale, zoomed, onCountScale, onOpacityScale, onZoom }) {
  return (
    <>
      <div class="row">
        <SegmentedField label="Histogram" value={countScale} options={kCountScales} onChange={onCountScale} />
        <span class="space" />
        <span class="buttons" role="group" aria-label="Zoom of the value axis">
          <button type="button" aria-label="Show fewer values" title="Show fewer values" onClick={() => onZoom(2)}>+</button>
          <button type="button" aria-label="Show more values" title="Show more values" disabled={!zoomed} onClick={() => onZoom(0.5)}>−</button>
        </span>
      </div>
      <SegmentedField label="Opacity axis" value={opacityScale} options={kOpacityScales} onChange={onOpacityScale} />
    </>
  );
}

/**
 * Edits a transfer function.
 * @param {object} props
 * @param {import("../types.js").Transfer} props.transfer
 * @param {import("../types.js").Description} props.description
 * @param {import("../types.js").Grid} props.grid
 * @param {import("../types.js").Histogram | null} props.histogram
 * @param {(transfer: import("../types.js").Transfer, moving: boolean) => void} props.onChange
 * @param {any} props.files  controls that open and save presets
 */
export function Editor({ transfer, description, grid, histogram, onChange, files }) {
  const [countScale, setCountScale] = useState("log");
  const [opacityScale, setOpacityScale] = useState("linear");
  const [chosen, setChosen] = useState(0);
  const [part, setPart] = useState(/** @type {Range | null} */ (null));
  const full = fullRange(grid.range, rangeOf(transfer));
  const shown = part ?? full;
  const index = Math.min(chosen, transfer.opacity.length - 1);
  const setOpacity = (/** @type {typeof transfer.opacity} */ opacity, /** @type {boolean} */ moving) =>
    onChange({ ...transfer, opacity }, moving);
  const zoom = (/** @type {number} */ factor, value = (shown[0] + shown[1]) / 2) =>
    setPart(zoomedRange(shown, full, factor, value));
  const curve = curveName(transfer, description.opacities);
  const curves = /** @type {[string, string][]} */ (Object.keys(description.opacities).map((name) => [name, titleOf(name)]));
  return (
    <div class="editor">
      <AxisFields
        countScale={countScale} opacityScale={opacityScale} zoomed={part !== null}
        onCountScale={setCountScale} onOpacityScale={setOpacityScale} onZoom={zoom}
      />
      <Plot
        transfer={transfer} histogram={histogram} shown={shown} countScale={/** @type {any} */ (countScale)}
        opacityScale={/** @type {any} */ (opacityScale)} selected={index} onSelect={setChosen} onChange={setOpacity} onZoom={zoom}
      />
      <ColorPoints transfer={transfer} shown={shown} unit={grid.unit} onChange={onChange} />
      <p class="hint">
        The line is the opacity of each value; the grey area counts the voxels of each value. Click to add a point, drag it to move
        it, press Delete to remove it.
      </p>
      <PointFields points={transfer.opacity} index={index} unit={grid.unit} onSelect={setChosen} onChange={setOpacity} />
      <SelectField
        label="Opacity curve" value={curve} options={curve === kCustom ? [[kCustom, "Own points"], ...curves] : curves}
        onChange={(name) => name !== kCustom && onChange(withCurve(transfer, description.opacities[name]), false)}
      />
      <RangeFields transfer={transfer} data={grid.range} unit={grid.unit} onChange={(t) => onChange(t, false)} />
      <MapChooser
        maps={description.colormaps} value={colorMapName(transfer, description.colormaps)}
        onChange={(name) => onChange(withColorMap(transfer, description.colormaps[name]), false)}
      />
      <div class="row">
        <button type="button" onClick={() => onChange(withInvertedColors(transfer), false)}>Invert colors</button>
        {files}
      </div>
    </div>
  );
}
