import { useId, useState } from "preact/hooks";
import { shortText } from "../look/number-text.js";

/**
 * A number with its label. The value is taken over when Enter is pressed or the field is left, and
 * with every step of the arrow keys.
 * @param {object} props
 * @param {string} props.label
 * @param {number} props.value
 * @param {(value: number) => void} props.onChange
 * @param {number} [props.min]
 * @param {number} [props.max]
 * @param {number} [props.step]  of the arrow keys
 * @param {string} [props.unit]
 * @param {boolean} [props.hideLabel]  the label is for screen readers only
 * @param {string} [props.hint]
 */
export function NumberField({ label, value, onChange, min = -Infinity, max = Infinity, step, unit, hideLabel, hint }) {
  const id = useId();
  const [text, setText] = useState(/** @type {string | null} */ (null));
  const stride = step ?? (Math.abs(value) / 100 || 0.01);
  const take = (/** @type {number} */ v) => Number.isFinite(v) && onChange(Math.min(max, Math.max(min, v)));
  const commit = () => {
    if (text !== null && text.trim() !== "") take(Number(text.replace(",", ".")));
    setText(null);
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ event) => {
    const sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (event.key === "Enter") commit();
    if (event.key === "Escape") setText(null);
    if (!sign) return;
    event.preventDefault();
    setText(null);
    take(Number((value + sign * stride * (event.shiftKey ? 10 : 1)).toPrecision(12)));
  };
  return (
    <span class="field" title={hint}>
      <label for={id} class={hideLabel ? "unseen" : undefined}>{label}</label>
      <span class="number">
        <input
          id={id} type="text" inputMode="decimal" autoComplete="off" spellcheck={false}
          aria-description={hint} value={text ?? shortText(value, 6)}
          onInput={(event) => setText(event.currentTarget.value)}
          onBlur={commit} onKeyDown={onKeyDown}
          onFocus={(event) => event.currentTarget.select()}
        />
        {unit && <span class="unit">{unit}</span>}
      </span>
    </span>
  );
}
