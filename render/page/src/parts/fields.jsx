import { useId } from "preact/hooks";

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
