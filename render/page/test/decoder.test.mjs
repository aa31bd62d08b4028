// The decoder of the exported page, without a browser. It reads every file of the format's golden tests, so that a
// decoder.wasm without a new section of the format is found here, also where Emscripten is not installed.
import assert from "node:assert/strict";
import { mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { Decoder } from "../src/local/decoder.js";
import { run } from "./support.mjs";

const golden = new URL("../../../tests/format/golden/", import.meta.url);
const decoder = await Decoder.load(readFileSync(new URL("../decoder.wasm", import.meta.url)));
const kLimits = { mostSide: 2048, mostBytes: 2 ** 26 };
const kSide = 9; // voxels along a slot of an atlas, whose neighbours are 8 apart

const opened = (name) => decoder.open(readFileSync(new URL(name, golden)), name);

/** The voxels of a grid without a level of detail, as values by place. */
function valuesOf(file, grid) {
  const volume = decoder.decode(file, grid), atlas = decoder.atlas(volume, 0, kLimits);
  const { origin, bricks, slots, table, voxels, background, scale } = atlas;
  const valueAt = (place) => {
    const inBox = place.map((c, a) => c - origin[a]), brick = inBox.map((c) => c >> 3);
    if (brick.some((c, a) => c < 0 || c >= bricks[a])) return background;
    const entry = 4 * ((brick[2] * bricks[1] + brick[1]) * bricks[0] + brick[0]);
    if (table[entry + 3] > 0) return background;
    const [x, y, z] = inBox.map((c, a) => kSide * table[entry + a] + (c & 7));
    return background + scale * voxels[(z * kSide * slots[1] + y) * kSide * slots[0] + x];
  };
  const active = decoder.histogram(volume, [0, 2], 16).reduce((sum, count) => sum + count, 0);
  return { valueAt, areFinite: voxels.every(Number.isFinite), active, level: atlas.level };
}

for (const name of readdirSync(golden))
  test(`${name} is decoded`, () => {
    const file = opened(name);
    for (const grid of decoder.grids(file).keys()) {
      const { areFinite, level } = valuesOf(file, grid);
      assert.ok(areFinite);
      assert.equal(level, 0);
    }
  });

test("voxels that are NaN or infinite are empty, and all others are those of the file without them", () => {
  const [whole, holed] = ["voxels.esvr", "non_finite.esvr"].map((name) => valuesOf(opened(name), 0));
  const isHole = ([x, y, z]) => (x === -6 && y === 19 && z >= 4 && z < 8) || (x === -1 && y === 23 && z === 15);
  const kBackground = 0.125;
  let holes = 0;
  for (let x = -8; x < 0; ++x)
    for (let y = 16; y < 24; ++y)
      for (let z = 0; z < 16; ++z) {
        const place = [x, y, z];
        holes += isHole(place);
        assert.equal(holed.valueAt(place), isHole(place) ? kBackground : whole.valueAt(place), `${place}`);
      }
  assert.equal(holes, 5);
  assert.equal(holed.active, whole.active - holes);
});

test("a file may need more memory than the module has at first, which is 16 MB", (t) => {
  const folder = mkdtempSync(join(tmpdir(), "esvr-decoder-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  const [vdb, esvr] = ["plume.vdb", "plume.esvr"].map((name) => join(folder, name));
  run("ESVR_SAMPLE", ["plume", vdb, "--resolution", "280"]);
  run("VDB2ESVR", [vdb, esvr, "--max-error", "10%"]);
  const file = decoder.open(readFileSync(esvr), "plume.esvr"); // asks for 11.9 MB
  const { areFinite, active } = valuesOf(file, 0);
  assert.ok(areFinite && active > 500_000, `${active} active voxels`);
});
