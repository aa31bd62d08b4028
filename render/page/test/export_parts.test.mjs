// The parts of the exported page that need no browser: packed bytes, presets and command lines.
import assert from "node:assert/strict";
import { test } from "node:test";
import { decoded, encoded } from "../src/local/base91.js";
import { commandOf } from "../src/local/command.js";
import { presetsOf } from "../src/local/presets.js";
import { kDefaults } from "../src/state/scene.js";

test("bytes come back from their text", () => {
  for (let size = 0; size < 300; ++size)
    for (const byteAt of [() => 0, () => 255, (i) => (i * 197 + size) % 256]) {
      const bytes = Uint8Array.from({ length: size }, (_, i) => byteAt(i));
      assert.deepEqual(decoded(encoded(bytes)), bytes);
    }
});

test("the text of bytes cannot end a script of HTML, and is short", () => {
  const bytes = Uint8Array.from({ length: 10_000 }, (_, i) => (i * i * 31 + i) % 256), text = encoded(bytes);
  assert.match(text, /^[!-~]*$/);
  assert.ok(!text.includes("<"));
  assert.ok(text.length < 1.25 * bytes.length);
});

test("ParaView's JSON presets are read, with a linear opacity if they have none", () => {
  const colors = { RGBPoints: [1, 0, 0, 1, 0, 1, 0, 0] };
  const [first, second] = presetsOf(JSON.stringify([{ Name: "A", ...colors }, { Name: "B", ColorSpace: "HSV", HSVWrap: 1, ...colors, Points: [0, 0.5, 0.5, 0] }, { Name: "C" }]));
  assert.deepEqual(first, { name: "A", transfer: { space: "RGB", colors: [[0, 1, 0, 0], [1, 0, 0, 1]], opacity: [[0, 0, 0.5, 0], [1, 1, 0.5, 0]] } });
  assert.equal(second.transfer.space, "HSVWrap");
  assert.deepEqual(second.transfer.opacity, [[0, 0.5, 0.5, 0]]);
});

test("files that are no presets are refused with a reason", () => {
  assert.throws(() => presetsOf("[]"), /no preset with RGBPoints/);
  assert.throws(() => presetsOf('{"RGBPoints":[1,2,3]}'), /4 a point/);
  assert.throws(() => presetsOf('{"RGBPoints":[0,0,0,0],"ColorSpace":"Nothing"}'), /none of RGB/);
});

test("a command has the options that differ from the defaults, quoted for a shell", () => {
  const camera = { eye: [0, 0, 9], center: [0, 0, 0], up: [0, 1, 0], height: 8 };
  const transfer = { space: "RGB", colors: [[0, 0, 0, 0]], opacity: [[0, 0, 0.5, 0]] };
  const scene = { ...kDefaults, file: 0, grid: 0, frame: null, camera, transfer, shade: true, slice: { axis: "z", place: 3.5 } };
  const description = { files: [{ name: "it's.esvr", grids: [{ name: "density" }] }] };
  const { text } = commandOf({ scene, width: 40, height: 30 }, description);
  assert.equal(
    text,
    `esvr-render 'it'\\''s.esvr' picture.png --resolution=40x30 --eye=0,0,9 --center=0,0,0 --up=0,1,0 --orthographic ` +
      "--height=8 --tf=transfer.json --range=own --classification=pre --lod=auto --between=voxels --shade --slice=z=3.5",
  );
});
