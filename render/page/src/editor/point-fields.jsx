import { withAddedPoint, withPoint, withoutPoint, opacityAt } from "../look/transfer.js";
import { NumberField } from "../parts/number-field.jsx";

/**
 * A new point halfway to the next point, or to the one before.
 * @param {import("../types.js").OpacityPoint[]} points @param {number} index
 */
function newPoint(points, index) {
  const other = points[index + 1] ?? points[index - 1] ?? points[index];
  const value = (points[index][0] + other[0]) / 2;
  return withAddedPoint(points, [value, opacityAt(points, value), 0.5, 0]);
}

/**
 * The selected point of the opacity curve as numbers.
 * @param {object} props
 * @param {import("../types.js").OpacityPoint[]} props.points
 * @param {number} props.index
 * @param {string} props.unit
 * @param {(index: number) => void} props.onSelect
 * @param {(points: import("../types.js").OpacityPoint[], moving: boolean) => void} props.onChange
 */
export function PointFields({ points, index, unit, onSelect, onChange }) {
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
