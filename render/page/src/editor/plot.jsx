import { hexOf } from "../look/css-color.js";
import { colorAt, withAddedPoint, withPoint, withoutPoint } from "../look/transfer.js";
import { useSize } from "../parts/use-size.js";
import { useWheel } from "../parts/use-wheel.js";
import { Axes } from "./axes.jsx";
import { CurvePoint } from "./curve-point.jsx";
import { areaBelow, curvePath } from "./curve-path.js";
import { histogramPath } from "./histogram-path.js";
import { scalesOf } from "./scales.js";
import { useAdding } from "./use-adding.js";

const kStops = 48; // of the gradient below the curve

/** @param {{transfer: import("../types.js").Transfer, scales: import("./scales.js").Scales}} props */
function Gradient({ transfer, scales: { left, width, low, high } }) {
  const shares = Array.from({ length: kStops + 1 }, (_, i) => i / kStops);
  return (
    <linearGradient id="curve-colors" gradientUnits="userSpaceOnUse" x1={left} x2={left + width} y1="0" y2="0">
      {shares.map((s) => <stop key={s} offset={s} stop-color={hexOf(colorAt(transfer, low + s * (high - low)))} />)}
    </linearGradient>
  );
}

/**
 * A curve with a point elsewhere.
 * @param {import("../types.js").OpacityPoint[]} points @param {number} index
 * @param {number} value @param {number} opacity
 */
function withMoved(points, index, value, opacity) {
  const [, , midpoint, sharpness] = points[index];
  return withPoint(points, index, [value, opacity, midpoint, sharpness]);
}

/**
 * What is behind the points.
 * @param {object} props
 * @param {import("../types.js").Transfer} props.transfer
 * @param {import("./scales.js").Scales} props.scales
 * @param {import("../types.js").Histogram | null} props.histogram
 * @param {import("./histogram-path.js").CountScale} props.countScale
 */
function Curve({ transfer, scales, histogram, countScale }) {
  const path = curvePath(transfer.opacity, scales);
  return (
    <g clip-path="url(#plot-inside)">
      {histogram && <path class="histogram" d={histogramPath(histogram, countScale, scales)} />}
      <path class="area" d={areaBelow(path, scales)} fill="url(#curve-colors)" />
      <path class="curve-back" d={path} /><path class="curve" d={path} />
    </g>
  );
}

/**
 * The opacity curve over the histogram.
 * @param {object} props
 * @param {import("../types.js").Transfer} props.transfer
 * @param {import("../types.js").Histogram | null} props.histogram
 * @param {import("../look/transfer.js").Range} props.shown  values at the ends of the axis
 * @param {import("./histogram-path.js").CountScale} props.countScale
 * @param {import("./scales.js").OpacityScale} props.opacityScale
 * @param {number} props.selected
 * @param {(index: number) => void} props.onSelect
 * @param {(opacity: import("../types.js").OpacityPoint[], moving: boolean) => void} props.onChange
 * @param {(factor: number, value: number) => void} props.onZoom  about a value
 */
export function Plot({ transfer, histogram, shown, countScale, opacityScale, selected, onSelect, onChange, onZoom }) {
  const { ref, size } = useSize();
  const scales = scalesOf(size, shown, opacityScale);
  const placeOf = (/** @type {MouseEvent} */ event) => {
    const { left, top } = ref.current.getBoundingClientRect();
    return { value: scales.valueAt(event.clientX - left), opacity: scales.opacityAt(event.clientY - top) };
  };
  useWheel(ref, (/** @type {WheelEvent} */ event) => onZoom(Math.exp(-event.deltaY / 500), placeOf(event).value));
  const points = transfer.opacity;
  const remove = (/** @type {number} */ index) => {
    if (points.length < 2) return;
    onChange(withoutPoint(points, index), false);
    onSelect(Math.min(index, points.length - 2));
  };
  const add = (/** @type {import("./use-adding.js").Place} */ { value, opacity }) => {
    const added = withAddedPoint(points, [value, opacity, 0.5, 0]);
    onSelect(added.index);
    onChange(added.points, true);
    return (/** @type {import("./use-adding.js").Place} */ to) =>
      onChange(withMoved(added.points, added.index, to.value, to.opacity), true);
  };
  const adding = useAdding(placeOf, add);
  return (
    <svg ref={ref} class="plot" role="group" aria-label="Opacity curve over the histogram" {...adding}>
      <defs>
        <Gradient transfer={transfer} scales={scales} />
        <clipPath id="plot-inside"><rect x={scales.left} y={0} width={scales.width} height={scales.top + scales.height} /></clipPath>
      </defs>
      <rect class="paper" x={scales.left} y={scales.top} width={scales.width} height={scales.height} />
      <Axes scales={scales} opacityScale={opacityScale} />
      <Curve transfer={transfer} scales={scales} histogram={histogram} countScale={countScale} />
      {points.map(([value], index) => value >= scales.low && value <= scales.high && (
        <CurvePoint
          key={index} transfer={transfer} index={index} selected={index === selected} scales={scales}
          onSelect={() => onSelect(index)} onRemove={() => remove(index)}
          onMove={(v, opacity) => onChange(withMoved(points, index, v, opacity), true)}
        />
      ))}
    </svg>
  );
}
