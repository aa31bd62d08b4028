import { shortText } from "../look/number-text.js";
import { kOpacityTicks, ticksOf } from "./scales.js";

const kPixelsPerTick = 70;

/** @param {{scales: import("./scales.js").Scales, opacityScale: import("./scales.js").OpacityScale}} props */
export function Axes({ scales, opacityScale }) {
  const { left, top, width, height, low, high } = scales;
  const values = ticksOf([low, high], Math.max(2, Math.floor(width / kPixelsPerTick)));
  return (
    <g class="axes" aria-hidden="true">
      {kOpacityTicks[opacityScale].map((opacity) => (
        <g key={opacity}>
          <line x1={left} x2={left + width} y1={scales.y(opacity)} y2={scales.y(opacity)} />
          <text x={left - 6} y={scales.y(opacity)} dy="0.32em" text-anchor="end">{opacity}</text>
        </g>
      ))}
      {values.map((value) => (
        <g key={value}>
          <line class="tick" x1={scales.x(value)} x2={scales.x(value)} y1={top + height} y2={top + height + 4} />
          <text x={scales.x(value)} y={top + height + 16} text-anchor="middle">{shortText(value)}</text>
        </g>
      ))}
    </g>
  );
}
