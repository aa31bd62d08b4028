/**
 * The editor of the transfer function.
 * @typedef {import("../types.js").Description} Description
 * @typedef {import("../types.js").Grid} Grid
 * @typedef {import("../types.js").Histogram} Histogram
 * @typedef {import("../types.js").OpacityPoint} OpacityPoint
 * @typedef {import("../transfer.js").Range} Range
 * @typedef {import("../types.js").Transfer} Transfer
 */
import { useState } from "preact/hooks";
import { NumberField, SegmentedField, SelectField } from "../controls.jsx";
import {
  colorMapName, curveName, halfwayFrom, opacityAt, rangeOf, withAddedPoint, withColorMap, withCurve, withInvertedColors, withoutPoint, withPoint, withRange,
} from "../transfer.js";
import { ColorPoints, MapChooser, titleOf } from "./colors.jsx";
import { Plot } from "./plot.jsx";

/**
 * The values that the colors and opacities cover.
 * @param {object} props
 * @param {Transfer} props.transfer
 * @param {Range} props.data  range of the active voxels
 * @param {string} props.unit
 * @param {(transfer: Transfer) => void} props.onChange
 */
function RangeFields({ transfer, data, unit, onChange }) {
  const [low, high] = rangeOf(transfer);
  const set = (/** @type {number} */ a, /** @type {number} */ b) => a < b && onChange(withRange(transfer, [a, b]));
  return (
    <fieldset class="point-fields">
      <legend>Range of values{unit && ` in ${unit}`}</legend>
      <div class="row">
        <NumberField label="From" value={low} onChange={(v) => set(v, high)} />
        <NumberField label="to" value={high} onChange={(v) => set(low, v)} />
        <span class="space" />
        <button type="button" onClick={() => set(...data)} title="Cover exactly the values of the active voxels">
          Use all values
        </button>
      </div>
    </fieldset>
  );
}

/**
 * A new point halfway to the next point, or to the one before.
 * @param {OpacityPoint[]} points @param {number} index
 */
function newPoint(points, index) {
  const value = halfwayFrom(points, index);
  return withAddedPoint(points, [value, opacityAt(points, value), 0.5, 0]);
}

/**
 * The selected point of the opacity curve as numbers.
 * @param {object} props
 * @param {OpacityPoint[]} props.points
 * @param {number} props.index
 * @param {string} props.unit
 * @param {(index: number) => void} props.onSelect
 * @param {(points: OpacityPoint[], moving: boolean) => void} props.onChange
 */
function PointFields({ points, index, unit, onSelect, onChange }) {
  const point = points[index];
  const set = (/** @type {number} */ member) => (/** @type {number} */ v) =>
    onChange(withPoint(points, index, /** @type {any} */ (point.with(member, v))), false);
  const add = () => {
    const added = newPoint(points, index);
    onChange(added.points, false);
    onSelect(added.index);
  };
  const remove = () => {
    onChange(withoutPoint(points, index), false);
    onSelect(Math.max(0, index - 1));
  };
  return (
    <fieldset class="point-fields">
      <legend>Opacity point {index + 1} of {points.length}</legend>
      <div class="row">
        <button type="button" disabled={index === 0} onClick={() => onSelect(index - 1)}>Previous</button>
        <button type="button" disabled={index === points.length - 1} onClick={() => onSelect(index + 1)}>Next</button>
        <span class="space" />
        <button type="button" onClick={add}>Add</button>
        <button type="button" disabled={points.length < 2} onClick={remove}>Remove</button>
      </div>
      <div class="grid">
        <NumberField label="Value" value={point[0]} onChange={set(0)} unit={unit} />
        <NumberField label="Opacity" value={point[1]} min={0} max={1} onChange={set(1)} />
        <NumberField
          label="Midpoint" value={point[2]} min={0} max={1} step={0.05} onChange={set(2)}
          hint="Where the curve is halfway to the next point, as a share of the way"
        />
        <NumberField
          label="Sharpness" value={point[3]} min={0} max={1} step={0.05} onChange={set(3)}
          hint="0: a straight line to the next point; 1: a step"
        />
      </div>
    </fieldset>
  );
}

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
 * @param {Transfer} props.transfer
 * @param {Description} props.description
 * @param {Grid} props.grid
 * @param {Histogram | null} props.histogram
 * @param {(transfer: Transfer, moving: boolean) => void} props.onChange
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
