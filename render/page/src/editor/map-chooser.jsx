import { useId } from "preact/hooks";
import { extentOf } from "../look/transfer.js";
import { rampStyle } from "./color-ramp.jsx";

/** "cool-to-warm" as "Cool to warm"; "x-ray" and "ct-bone" as the terms are written. @param {string} name */
export function titleOf(name) {
  const text = name.replace(/^x-ray$/, "X-ray").replace(/^ct-/, "CT ").replaceAll(/-(?!ray)/g, " ");
  return text[0].toUpperCase() + text.slice(1);
}

/**
 * The color maps, each with its colors.
 * @param {object} props
 * @param {Record<string, import("../types.js").ColorMap>} props.maps
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
