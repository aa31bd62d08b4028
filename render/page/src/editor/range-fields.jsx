import { rangeOf, withRange } from "../look/transfer.js";
import { NumberField } from "../parts/number-field.jsx";

/**
 * The values that the colors and opacities cover.
 * @param {object} props
 * @param {import("../types.js").Transfer} props.transfer
 * @param {import("../look/transfer.js").Range} props.data  range of the active voxels
 * @param {string} props.unit
 * @param {(transfer: import("../types.js").Transfer) => void} props.onChange
 */
export function RangeFields({ transfer, data, unit, onChange }) {
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
