import { useEffect, useRef, useState } from "preact/hooks";
import { Dialog } from "./parts/dialog.jsx";
import { NumberField } from "./parts/number-field.jsx";
import { copyText, saveBlob, saveText } from "./parts/save-file.js";

const kMostPixels = 4096;
/** @type {[string, number, number][]} */
const kSizes = [["1024 × 1024", 1024, 1024], ["1920 × 1080", 1920, 1080], ["3840 × 2160", 3840, 2160]];

/**
 * The command that makes the picture; asked again when the size changes.
 * @param {import("./types.js").Backend} backend @param {import("./types.js").Scene} scene
 * @param {{width: number, height: number}} size @param {(text: string) => void} onMessage
 */
function useCommand(backend, scene, { width, height }, onMessage) {
  const [command, setCommand] = useState(/** @type {import("./types.js").Command | null} */ (null));
  useEffect(() => {
    let wanted = true;
    if (backend.can.has("command"))
      backend.command({ scene, width, height }).then((c) => wanted && setCommand(c), (e) => onMessage(e.message));
    return () => void (wanted = false);
  }, [scene, width, height]);
  return command;
}

/** @param {{command: import("./types.js").Command, onMessage: (text: string) => void}} props */
function CommandPart({ command, onMessage }) {
  const text = useRef(/** @type {any} */ (null));
  const copy = async () => {
    if (await copyText(command.text)) return onMessage("The command is on the clipboard.");
    text.current.select();
    onMessage("The browser does not allow copying here. The command is selected: press Ctrl+C.");
  };
  return (
    <section>
      <h3>The same picture by esvr-render</h3>
      <textarea ref={text} aria-label="Command" readOnly rows={5} value={command.text} />
      <div class="row">
        <button type="button" onClick={copy}>Copy command</button>
        {command.transfer && (
          <button type="button" onClick={() => saveText(command.transfer ?? "", "transfer.json", "application/json")}>
            Save transfer.json
          </button>
        )}
      </div>
      {command.transfer && <p class="hint">The command reads the colors and opacities from transfer.json. Save it into the folder where the command runs.</p>}
    </section>
  );
}

/**
 * Saves the picture, and shows the command that makes it.
 * @param {object} props
 * @param {import("./types.js").Backend} props.backend
 * @param {import("./types.js").Scene} props.scene
 * @param {{width: number, height: number}} props.pixels
 * @param {string} props.name
 * @param {() => void} props.onClose
 * @param {(text: string) => void} props.onMessage
 */
export function SaveDialog({ backend, scene, pixels, name, onClose, onMessage }) {
  const [size, setSize] = useState(pixels);
  const [saving, setSaving] = useState(false);
  const [message, setMessage] = useState("");
  const command = useCommand(backend, scene, size, setMessage);
  const save = async () => {
    setSaving(true);
    try {
      saveBlob(await backend.png({ scene, ...size }), `${name}.png`);
      setMessage("The picture is saved.");
    } catch (error) {
      setMessage(/** @type {Error} */ (error).message);
    }
    setSaving(false);
  };
  const presets = [["As shown", pixels.width, pixels.height], ...kSizes];
  return (
    <Dialog title="Save picture" onClose={onClose}>
      <fieldset class="point-fields">
        <legend>Size in pixels</legend>
        <div class="row">
          <NumberField label="Width" value={size.width} min={1} max={kMostPixels} step={1} onChange={(width) => setSize({ ...size, width: Math.round(width) })} />
          <NumberField label="Height" value={size.height} min={1} max={kMostPixels} step={1} onChange={(height) => setSize({ ...size, height: Math.round(height) })} />
        </div>
        <div class="row">
          {presets.map(([text, width, height]) => (
            <button key={text} type="button" onClick={() => setSize({ width: Number(width), height: Number(height) })}>{text}</button>
          ))}
        </div>
      </fieldset>
      {backend.can.has("png") && (
        <button type="button" class="primary" disabled={saving} onClick={save}>{saving ? "Drawing…" : "Save PNG"}</button>
      )}
      {command && <CommandPart command={command} onMessage={(text) => (setMessage(text), onMessage(text))} />}
      <p role="status" class="hint">{message}</p>
    </Dialog>
  );
}
