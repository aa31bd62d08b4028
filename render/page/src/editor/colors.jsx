/**
 * The colors of the transfer function: the bar with its points, and the choice of a map.
 * @typedef {import("../types.js").ColorMap} ColorMap
 * @typedef {import("../types.js").ColorPoint} ColorPoint
 * @typedef {import("../transfer.js").Range} Range
 * @typedef {import("../types.js").Transfer} Transfer
 */
import { useId, useState } from "preact/hooks";
import { follow, useSize } from "../browser.js";
import { NumberField } from "../controls.jsx";
import { hexOf, shortText, tripleOf } from "../text.js";
import { colorAt, extentOf, halfwayFrom, withAddedPoint, withFewerColors, withoutPoint, withPoint } from "../transfer.js";
import { kCoarse, kFine, kMargins } from "./scales.js";

/**
 * Colors from a value to another one, as the background of an element.
 * @param {{space: string, colors: ColorPoint[]}} look
 * @param {Range} range @param {number} [stops]
 */
export function rampStyle(look, [low, high], stops = 32) {
  const colors = Array.from({ length: stops + 1 }, (_, i) => hexOf(colorAt(look, low + ((high - low) * i) / stops)));
  return { backgroundImage: `linear-gradient(to right, ${colors.join(",")})` };
}

/**
 * A color point on the bar of colors.
 * @param {object} props
 * @param {ColorPoint[]} props.colors
 * @param {number} props.index
 * @param {Range} props.shown
 * @param {number} props.width  of the bar in pixels
 * @param {boolean} props.selected
 * @param {() => void} props.onSelect
 * @param {(value: number) => void} props.onMove
 * @param {() => void} props.onRemove
 */
function ColorHandle({ colors, index, shown: [low, high], width, selected, onSelect, onMove, onRemove }) {
  const [value, ...color] = colors[index];
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
    follow(event, (e) => onMove(value + ((e.clientX - event.clientX) / width) * (high - low)));
  };
  return (
    <span
      class={selected ? "handle selected" : "handle"} role="slider" tabindex={0}
      style={{ left: `${(100 * (value - low)) / (high - low)}%`, background: hexOf(color) }}
      aria-label={`Color point ${index + 1} of ${colors.length}`}
      aria-valuenow={value} aria-valuemin={low} aria-valuemax={high}
      aria-valuetext={`color ${hexOf(color)} at value ${shortText(value)}`}
      onPointerDown={onPointerDown} onKeyDown={onKeyDown} onFocus={onSelect}
    />
  );
}

/**
 * The selected color point as a number and a color.
 * @param {object} props
 * @param {ColorPoint[]} props.colors
 * @param {number} props.index
 * @param {string} props.unit
 * @param {(colors: ColorPoint[], moving?: boolean) => void} props.onChange
 * @param {() => void} props.onAdd
 * @param {() => void} props.onRemove
 */
function ColorFields({ colors, index, unit, onChange, onAdd, onRemove }) {
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

const kMostHandles = 24; // more lie too close to be moved
const kFewColors = 9;
const kRampStops = 64;

/** The bar of colors lies exactly below the axis of values. */
const kAligned = { marginLeft: kMargins.left + "px", marginRight: kMargins.right + "px" };

/**
 * @typedef {object} Props
 * @property {Transfer} transfer
 * @property {Range} shown  values at the ends of the axis
 * @property {string} unit
 * @property {(transfer: Transfer, moving: boolean) => void} onChange
 */

/** Colors that are too many to be edited. @param {Props} props */
function WholeMap({ transfer, shown, onChange }) {
  return (
    <div class="color-points">
      <div class="ramp whole" style={{ ...rampStyle(transfer, shown, kRampStops), ...kAligned }} />
      <p class="row hint">
        This map has {transfer.colors.length} colors.
        <button type="button" onClick={() => onChange(withFewerColors(transfer, kFewColors), false)}>
          Reduce to {kFewColors} to edit them
        </button>
      </p>
    </div>
  );
}

/** Colors with a handle for each point. @param {Props} props */
function EditableMap({ transfer, shown, unit, onChange }) {
  const { ref, size } = useSize();
  const [chosen, setChosen] = useState(0);
  const { colors } = transfer, [low, high] = shown;
  const index = Math.min(chosen, colors.length - 1);
  const set = (/** @type {typeof colors} */ points, moving = false) => onChange({ ...transfer, colors: points }, moving);
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
  const onClick = (/** @type {MouseEvent} */ event) => {
    if (event.target !== ref.current) return; // a handle
    const { left, width } = ref.current.getBoundingClientRect();
    add(low + ((event.clientX - left) / width) * (high - low));
  };
  return (
    <div class="color-points">
      <div
        ref={ref} class="ramp" role="group" aria-label="Colors of the values" onClick={onClick}
        style={{ ...rampStyle(transfer, shown, kRampStops), ...kAligned }}
      >
        {colors.map(([value], i) => value >= low && value <= high && (
          <ColorHandle
            key={i} colors={colors} index={i} shown={shown} width={size.width} selected={i === index}
            onSelect={() => setChosen(i)} onRemove={() => remove(i)}
            onMove={(v) => set(withPoint(colors, i, /** @type {any} */ (colors[i].with(0, v))), true)}
          />
        ))}
      </div>
      <ColorFields
        colors={colors} index={index} unit={unit} onChange={set} onAdd={() => add(halfwayFrom(colors, index))} onRemove={() => remove(index)}
      />
    </div>
  );
}

/** The colors below the axis of values. @param {Props} props */
export function ColorPoints(props) {
  return props.transfer.colors.length > kMostHandles ? <WholeMap {...props} /> : <EditableMap {...props} />;
}

/** "cool-to-warm" as "Cool to warm"; "x-ray" and "ct-bone" as the terms are written. @param {string} name */
export function titleOf(name) {
  const text = name.replace(/^x-ray$/, "X-ray").replace(/^ct-/, "CT ").replaceAll(/-(?!ray)/g, " ");
  return text[0].toUpperCase() + text.slice(1);
}

/**
 * The color maps, each with its colors.
 * @param {object} props
 * @param {Record<string, ColorMap>} props.maps
 * @param {string} props.value  "" if the colors are from none of them
 * @param {(name: string) => void} props.onChange
 */
export function MapChooser({ maps, value, onChange }) {
  const name = useId();
  return (
    <fieldset class="maps">
      <legend>Color map{value === "" && ": own colors"}</legend>
      {Object.entries(maps).map(([key, { space, points }]) => (
        <label key={key}>
          <input type="radio" name={name} value={key} checked={key === value} onChange={() => onChange(key)} />
          <span class="swatch" style={rampStyle({ space, colors: points }, extentOf(points), 16)} />
          <span>{titleOf(key)}</span>
        </label>
      ))}
    </fieldset>
  );
}
