/**
 * The controls of the page: icons, fields, foldable sections and dialogs.
 */
import { useEffect, useId, useRef, useState } from "preact/hooks";
import { shortText } from "./text.js";

/** Shapes in a square of 24. @type {Record<string, string>} */
const kPaths = {
  play: "M7 4.5v15l12-7.5z",
  pause: "M6 5h4v14H6zM14 5h4v14h-4z",
  back: "M17 5v14l-9-7zM6 5h2v14H6z",
  next: "M7 5v14l9-7zM16 5h2v14h-2z",
  undo: "M12 5a8 8 0 1 1-7.4 11h2.2A6 6 0 1 0 12 7H8.8l2.6 2.6L10 11 5 6l5-5 1.4 1.4L8.800 5z",
  redo: "M12 5a8 8 0 1 0 7.4 11h-2.200A6 6 0 1 1 12 7h3.200l-2.600 2.600L14 11l5-5-5-5-1.400 1.400L15.200 5z",
  save: "M11 3h2v9l3.300-3.300 1.400 1.400L12 15.800l-5.700-5.700 1.400-1.400L11 12zM4 17h2v3h12v-3h2v5H4z",
  link: "M10.600 13.400a1 1 0 0 1 0-1.400l1.400-1.400a1 1 0 0 1 1.400 1.400L12 13.400a1 1 0 0 1-1.400 0zM8 18.600a3 3 0 0 1-2.600-4.900l3.500-3.500-1.400-1.400L4 12.300a5 5 0 0 0 7.100 7.100l3.500-3.500-1.400-1.400-3.500 3.500A2.900 2.900 0 0 1 8 18.600zM19.900 4.600a5 5 0 0 0-7.100 0L9.300 8.100l1.400 1.400L14.200 6a3 3 0 1 1 4.200 4.200l-3.500 3.500 1.400 1.400 3.600-3.500a5 5 0 0 0 0-7z",
  theme: "M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zm0 2v14a7 7 0 0 0 0-14z",
  help: "M12 2a10 10 0 1 0 0 20 10 10 0 0 0 0-20zm0 2a8 8 0 1 1 0 16 8 8 0 0 1 0-16zm-1 11.500h2v2h-2zM12 6.500c-2 0-3.500 1.300-3.500 3.200h2c0-.8.600-1.300 1.500-1.300s1.500.500 1.500 1.200c0 1.500-2.500 1.500-2.500 4.400h2c0-1.800 2.500-2.100 2.500-4.500 0-1.800-1.500-3-3.500-3z",
  close: "M6.400 5 12 10.600 17.600 5 19 6.400 13.400 12l5.600 5.600-1.400 1.400L12 13.400 6.400 19 5 17.600 10.600 12 5 6.400z",
};

/** @param {{name: keyof typeof kPaths}} props */
export const Icon = ({ name }) => (
  <svg class="icon" viewBox="0 0 24 24" width="18" height="18" aria-hidden="true"><path d={kPaths[name]} fill-rule="evenodd" /></svg>
);

/**
 * @param {object} props
 * @param {string} props.label
 * @param {string} props.value
 * @param {readonly (readonly [string, string])[]} props.options  value and text of each
 * @param {(value: string) => void} props.onChange
 * @param {boolean} [props.hideLabel]
 * @param {boolean} [props.stacked]  the label is above
 * @param {string} [props.hint]
 */
export function SelectField({ label, value, options, onChange, hideLabel, stacked, hint }) {
  const id = useId();
  return (
    <span class={stacked ? "field stacked" : "field"} title={hint}>
      <label for={id} class={hideLabel ? "unseen" : undefined}>{label}</label>
      <select id={id} value={value} onChange={(event) => onChange(event.currentTarget.value)}>
        {options.map(([key, text]) => <option key={key} value={key}>{text}</option>)}
      </select>
    </span>
  );
}

/**
 * @param {object} props
 * @param {string} props.label
 * @param {boolean} props.checked
 * @param {(checked: boolean) => void} props.onChange
 * @param {string} [props.hint]
 */
export function CheckField({ label, checked, onChange, hint }) {
  return (
    <label class="check" title={hint}>
      <input type="checkbox" checked={checked} onChange={(event) => onChange(event.currentTarget.checked)} />
      {label}
    </label>
  );
}

/**
 * A choice of which all options are in sight.
 * @param {object} props
 * @param {string} props.label
 * @param {string} props.value
 * @param {readonly (readonly [string, string])[]} props.options
 * @param {(value: string) => void} props.onChange
 */
export function SegmentedField({ label, value, options, onChange }) {
  const name = useId();
  return (
    <fieldset class="segmented">
      <legend>{label}</legend>
      <span>
        {options.map(([key, text]) => (
          <label key={key}>
            <input type="radio" name={name} value={key} checked={key === value} onChange={() => onChange(key)} />
            <span>{text}</span>
          </label>
        ))}
      </span>
    </fieldset>
  );
}

/**
 * A number that is chosen on a scale.
 * @param {object} props
 * @param {string} props.label
 * @param {number} props.value
 * @param {number} props.min
 * @param {number} props.max
 * @param {number | "any"} [props.step]
 * @param {string} [props.text]  the value for screen readers
 * @param {boolean} [props.hideLabel]
 * @param {(value: number, moving: boolean) => void} props.onChange
 */
export function SliderField({ label, value, min, max, step = "any", text, hideLabel, onChange }) {
  const id = useId();
  return (
    <span class="field slider">
      <label for={id} class={hideLabel ? "unseen" : undefined}>{label}</label>
      <input
        id={id} type="range" min={min} max={max} step={step} value={value} aria-valuetext={text}
        onInput={(event) => onChange(event.currentTarget.valueAsNumber, true)}
      />
    </span>
  );
}

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

/**
 * A part of the panel that can be folded.
 * @param {{title: string, open?: boolean, note?: any, children: any}} props
 */
export function Section({ title, open = false, note, children }) {
  return (
    <details class="section" open={open}>
      <summary><h2>{title}</h2>{note && <span class="note">{note}</span>}</summary>
      <div class="content">{children}</div>
    </details>
  );
}

/** @param {{title: string, onClose: () => void, children: any}} props */
export function Dialog({ title, onClose, children }) {
  const ref = useRef(/** @type {any} */ (null));
  const id = useId();
  useEffect(() => ref.current.showModal(), []);
  const onClick = (/** @type {MouseEvent} */ event) => event.target === ref.current && onClose();
  return (
    <dialog ref={ref} aria-labelledby={id} onClose={onClose} onClick={onClick}>
      <header>
        <h2 id={id}>{title}</h2>
        <button type="button" class="icon" aria-label="Close" onClick={onClose}><Icon name="close" /></button>
      </header>
      <div class="content">{children}</div>
    </dialog>
  );
}
