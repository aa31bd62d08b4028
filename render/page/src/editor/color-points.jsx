import { useState } from "preact/hooks";
import { colorAt, withAddedPoint, withFewerColors, withPoint, withoutPoint } from "../look/transfer.js";
import { useSize } from "../parts/use-size.js";
import { ColorFields } from "./color-fields.jsx";
import { ColorHandle } from "./color-handle.jsx";
import { rampStyle } from "./color-ramp.jsx";
import { kMargins } from "./scales.js";

const kMostHandles = 24; // more lie too close to be moved
const kFewColors = 9;
const kRampStops = 64;

/** The place halfway to the next point, or to the one before. @param {number[][]} points @param {number} index */
function halfway(points, index) {
  const other = points[index + 1] ?? points[index - 1] ?? points[index];
  return (points[index][0] + other[0]) / 2;
}

/** The bar of colors lies exactly below the axis of values. */
const kAligned = { marginLeft: kMargins.left + "px", marginRight: kMargins.right + "px" };

/**
 * @typedef {object} Props
 * @property {import("../types.js").Transfer} transfer
 * @property {import("../look/transfer.js").Range} shown  values at the ends of the axis
 * @property {string} unit
 * @property {(transfer: import("../types.js").Transfer, moving: boolean) => void} onChange
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
        colors={colors} index={index} unit={unit} onChange={set} onAdd={() => add(halfway(colors, index))} onRemove={() => remove(index)}
      />
    </div>
  );
}

/** The colors below the axis of values. @param {Props} props */
export function ColorPoints(props) {
  return props.transfer.colors.length > kMostHandles ? <WholeMap {...props} /> : <EditableMap {...props} />;
}
