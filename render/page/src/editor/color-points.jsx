import { useState } from "preact/hooks";
import { hexOf, tripleOf } from "../look/css-color.js";
import { shortText } from "../look/number-text.js";
import { colorAt, withAddedPoint, withFewerColors, withPoint, withoutPoint } from "../look/transfer.js";
import { follow } from "../parts/drag.js";
import { NumberField } from "../parts/number-field.jsx";
import { useSize } from "../parts/use-size.js";
import { rampStyle } from "./color-ramp.jsx";
import { kMargins } from "./scales.js";

const kMostHandles = 24; // more lie too close to be moved
const kFewColors = 9;
const kCoarse = 0.02, kFine = 0.002; // shares of the axis that the arrow keys move a point by

/**
 * @typedef {object} Props
 * @property {import("../types.js").Transfer} transfer
 * @property {import("../look/transfer.js").Range} shown
 * @property {string} unit
 * @property {(transfer: import("../types.js").Transfer, moving: boolean) => void} onChange
 */

/**
 * @param {object} props
 * @param {Props["transfer"]} props.transfer
 * @param {Props["shown"]} props.shown
 * @param {number} props.index
 * @param {boolean} props.selected
 * @param {number} props.width
 * @param {() => void} props.onSelect
 * @param {(value: number) => void} props.onMove
 * @param {() => void} props.onRemove
 */
function Handle({ transfer, shown: [low, high], index, selected, width, onSelect, onMove, onRemove }) {
  const [value, ...color] = transfer.colors[index];
  const share = (value - low) / (high - low);
  const onKeyDown = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === "Delete" || event.key === "Backspace") return onRemove();
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    onMove(value + sign * (event.shiftKey ? kFine : kCoarse) * (high - low));
  };
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    onSelect();
    const start = event.clientX;
    follow(event, (e) => onMove(value + ((e.clientX - start) / width) * (high - low)));
  };
  return (
    <span
      class={selected ? "handle selected" : "handle"} style={{ left: `${100 * share}%`, background: hexOf(color) }}
      role="slider" tabindex={0} aria-label={`Color point ${index + 1} of ${transfer.colors.length}`}
      aria-valuenow={value} aria-valuemin={low} aria-valuemax={high}
      aria-valuetext={`color ${hexOf(color)} at value ${shortText(value)}`}
      onPointerDown={onPointerDown} onKeyDown={onKeyDown} onFocus={onSelect}
    />
  );
}

/** The colors below the axis of values, with a handle for each color point. @param {Props} props */
export function ColorPoints({ transfer, shown, unit, onChange }) {
  const { ref, size } = useSize();
  const [chosen, setChosen] = useState(0);
  const { colors } = transfer;
  const index = Math.min(chosen, colors.length - 1);
  const set = (/** @type {typeof colors} */ points, moving = false) => onChange({ ...transfer, colors: points }, moving);
  const editable = colors.length <= kMostHandles;
  const [low, high] = shown;
  const add = (/** @type {number} */ value) => {
    const added = withAddedPoint(colors, [value, ...colorAt(transfer, value)]);
    set(added.points);
    setChosen(added.index);
  };
  const remove = (/** @type {number} */ i) => {
    if (colors.length < 2) return;
    set(withoutPoint(colors, i));
    setChosen(Math.max(0, i - 1));
  };
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    if (!editable || event.button !== 0) return;
    const { left, width } = ref.current.getBoundingClientRect();
    add(low + ((event.clientX - left) / width) * (high - low));
  };
  const [value, ...color] = colors[index];
  const next = colors[index + 1] ?? colors[index - 1] ?? colors[index];
  return (
    <div class="color-points">
      <div
        ref={ref} class="ramp" role="group" aria-label="Colors of the values" onPointerDown={onPointerDown}
        style={{ ...rampStyle(transfer, shown, 64), marginLeft: kMargins.left + "px", marginRight: kMargins.right + "px" }}
      >
        {editable && colors.map(([x], i) => x >= low && x <= high && (
          <Handle
            key={i} transfer={transfer} shown={shown} index={i} selected={i === index} width={size.width}
            onSelect={() => setChosen(i)} onRemove={() => remove(i)}
            onMove={(v) => set(withPoint(colors, i, /** @type {any} */ (colors[i].with(0, v))), true)}
          />
        ))}
      </div>
      {!editable && (
        <p class="row hint">
          This map has {colors.length} colors.
          <button type="button" onClick={() => onChange(withFewerColors(transfer, kFewColors), false)}>
            Reduce to {kFewColors} to edit them
          </button>
        </p>
      )}
      {editable && (
        <fieldset class="point-fields titled">
          <legend>Color point {index + 1} of {colors.length}</legend>
          <div class="row">
            <span class="space" />
            <button type="button" onClick={() => add((value + next[0]) / 2)}>Add</button>
            <button type="button" disabled={colors.length < 2} onClick={() => remove(index)}>Remove</button>
          </div>
          <div class="row">
            <NumberField label="Value" value={value} unit={unit} onChange={(v) => set(withPoint(colors, index, [v, ...color]))} />
            <label class="field">
              <span>Color</span>
              <input
                type="color" value={hexOf(color)}
                onInput={(e) => set(withPoint(colors, index, [value, ...tripleOf(e.currentTarget.value)]), true)}
              />
            </label>
          </div>
        </fieldset>
      )}
    </div>
  );
}
