import { hexOf, tripleOf } from "../look/css-color.js";
import { withPoint } from "../look/transfer.js";
import { NumberField } from "../parts/number-field.jsx";

/**
 * The selected color point as a number and a color.
 * @param {object} props
 * @param {import("../types.js").ColorPoint[]} props.colors
 * @param {number} props.index
 * @param {string} props.unit
 * @param {(colors: import("../types.js").ColorPoint[], moving?: boolean) => void} props.onChange
 * @param {() => void} props.onAdd
 * @param {() => void} props.onRemove
 */
export function ColorFields({ colors, index, unit, onChange, onAdd, onRemove }) {
  const [value, ...color] = colors[index];
  return (
    <fieldset class="point-fields titled">
      <legend>Color point {index + 1} of {colors.length}</legend>
      <div class="row">
        <span class="space" />
        <button type="button" onClick={onAdd}>Add</button>
        <button type="button" disabled={colors.length < 2} onClick={onRemove}>Remove</button>
      </div>
      <div class="row">
        <NumberField label="Value" value={value} unit={unit} onChange={(v) => onChange(withPoint(colors, index, [v, ...color]))} />
        <label class="field">
          <span>Color</span>
          <input
            type="color" value={hexOf(color)}
            onInput={(e) => onChange(withPoint(colors, index, [value, ...tripleOf(e.currentTarget.value)]), true)}
          />
        </label>
      </div>
    </fieldset>
  );
}
