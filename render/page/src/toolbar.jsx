/**
 * The bar above the picture, and the dialogs that it opens.
 * @typedef {import("./types.js").Backend} Backend
 * @typedef {import("./types.js").Command} Command
 * @typedef {import("./types.js").Description} Description
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./scene.js").Store} Store
 */
import { useEffect, useRef, useState } from "preact/hooks";
import { applyTheme, copyText, kThemes, saveBlob, saveText, storedTheme } from "./browser.js";
import { Dialog, Icon, NumberField, SelectField } from "./controls.jsx";
import { kMostPixels } from "./scene.js";

const kHelp = [
  ["In the picture", [
    ["Drag, or one finger", "turn"],
    ["Shift and drag, right button, or two fingers", "shift"],
    ["Wheel, or pinch", "zoom"],
    ["Double click, or 0", "show all of the volume"],
    ["Arrow keys", "turn"],
    ["Shift and arrow keys", "shift"],
    ["+ and −", "zoom"],
  ]],
  ["In the opacity curve", [
    ["Click", "add a point"],
    ["Drag, or arrow keys", "move a point; with Shift, arrow keys make finer steps"],
    ["Delete, or right click", "remove a point"],
    ["Ctrl and wheel", "zoom the axis of values"],
  ]],
  ["Everywhere", [
    ["Ctrl+Z, Ctrl+Shift+Z", "undo and redo a change of settings"],
    ["Drop a file", "show a ParaView preset (JSON or XML)"],
    ["The address of the page", "reproduces the view: bookmark it or send it"],
  ]],
];

/** @param {{onClose: () => void}} props */
function HelpDialog({ onClose }) {
  return (
    <Dialog title="Mouse, touch and keys" onClose={onClose}>
      {kHelp.map(([title, rows]) => (
        <section key={String(title)}>
          <h3>{title}</h3>
          <dl class="facts">
            {/** @type {string[][]} */ (rows).map(([what, does]) => <div key={what}><dt>{what}</dt><dd>{does}</dd></div>)}
          </dl>
        </section>
      ))}
    </Dialog>
  );
}

/** @type {[string, number, number][]} */
const kSizes = [["1024 × 1024", 1024, 1024], ["1920 × 1080", 1920, 1080], ["3840 × 2160", 3840, 2160]];

/**
 * The command that makes the picture; asked again when the size changes.
 * @param {Backend} backend @param {Scene} scene
 * @param {{width: number, height: number}} size @param {(text: string) => void} onMessage
 */
function useCommand(backend, scene, { width, height }, onMessage) {
  const [command, setCommand] = useState(/** @type {Command | null} */ (null));
  useEffect(() => {
    let wanted = true;
    if (backend.can.has("command"))
      backend.command({ scene, width, height }).then((c) => wanted && setCommand(c), (e) => onMessage(e.message));
    return () => void (wanted = false);
  }, [scene, width, height]);
  return command;
}

/** @param {{command: Command, onMessage: (text: string) => void}} props */
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
 * @param {Backend} props.backend
 * @param {Scene} props.scene
 * @param {{width: number, height: number}} props.pixels
 * @param {string} props.name
 * @param {() => void} props.onClose
 * @param {(text: string) => void} props.onMessage
 */
function SaveDialog({ backend, scene, pixels, name, onClose, onMessage }) {
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

/** Undo and redo by the usual keys, except in fields of text, which have their own. */
function useUndoKeys(store) {
  useEffect(() => {
    const listen = (/** @type {KeyboardEvent} */ event) => {
      if (!(event.ctrlKey || event.metaKey) || /** @type {Element} */ (event.target).matches("input[type=text], textarea")) return;
      const key = event.key.toLowerCase();
      if (key === "z" && !event.shiftKey) store.undo();
      else if (key === "y" || key === "z") store.redo();
      else return;
      event.preventDefault();
    };
    addEventListener("keydown", listen);
    return () => removeEventListener("keydown", listen);
  }, []);
}

/** @param {{label: string, icon: string, wide?: boolean, disabled?: boolean, onClick: () => void}} props */
const Tool = ({ label, icon, wide, disabled, onClick }) => (
  <button type="button" class={wide ? "tool wide" : "tool"} aria-label={label} title={label} disabled={disabled} onClick={onClick}>
    <Icon name={icon} />{wide && <span>{label}</span>}
  </button>
);

function ThemeTool() {
  const [theme, setTheme] = useState(storedTheme);
  const next = kThemes[(kThemes.indexOf(/** @type {any} */ (theme)) + 1) % kThemes.length];
  return <Tool label={`Theme: ${theme}. Change to ${next}`} icon="theme" onClick={() => (applyTheme(next), setTheme(next))} />;
}

/**
 * @param {object} props
 * @param {Backend} props.backend
 * @param {Description} props.description
 * @param {Store} props.store
 * @param {{width: number, height: number}} props.pixels
 * @param {(file: number, grid: number) => void} props.onGrid
 * @param {(text: string) => void} props.onMessage
 */
export function Toolbar({ backend, description, store, pixels, onGrid, onMessage }) {
  const [dialog, setDialog] = useState("");
  useUndoKeys(store);
  const { scene } = store;
  const grids = description.files.flatMap(({ name, grids: all }, f) =>
    all.map((grid, g) => /** @type {[string, string]} */ ([`${f}/${g}`, `${name}: ${grid.name}`])));
  const choose = (/** @type {string} */ key) => onGrid(.../** @type {[number, number]} */ (key.split("/").map(Number)));
  const copyLink = async () =>
    onMessage((await copyText(location.href)) ? "The link to this view is on the clipboard." : "The address of this page is the link to this view.");
  const close = () => setDialog("");
  const { files } = description;
  return (
    <header class="toolbar">
      <h1>ESVR<span> viewer</span></h1>
      <div class="grids">
        <SelectField label="Volume" hideLabel value={`${scene.file}/${scene.grid}`} options={grids} onChange={choose} />
      </div>
      <span class="space" />
      <div class="tools" role="toolbar" aria-label="Tools">
        <Tool label="Undo" icon="undo" disabled={!store.canUndo} onClick={() => store.undo()} />
        <Tool label="Redo" icon="redo" disabled={!store.canRedo} onClick={() => store.redo()} />
        <Tool label="Copy link" icon="link" wide onClick={copyLink} />
        {(backend.can.has("png") || backend.can.has("command")) && (
          <Tool label="Save picture" icon="save" wide onClick={() => setDialog("save")} />
        )}
        <ThemeTool />
        <Tool label="Help" icon="help" onClick={() => setDialog("help")} />
      </div>
      {dialog === "save" && (
        <SaveDialog backend={backend} scene={scene} pixels={pixels} name={files[scene.file].name.replace(/\.\w+$/, "")} onClose={close} onMessage={onMessage} />
      )}
      {dialog === "help" && <HelpDialog onClose={close} />}
    </header>
  );
}
