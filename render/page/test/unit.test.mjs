// What the page computes, without a browser: transfer functions, the camera, links, and the parts of the exported page.
// Tolerances: float64 arithmetic of a few operations loses less than 1e-12 of numbers about 1; colors of tables are given
// with three digits.
import assert from "node:assert/strict";
import { test } from "node:test";
import { heightAtCenter, orbited, panned, projectionOf, withParallelRays, zoomed, zoomedAt } from "../src/camera.js";
import { kOpacityTicks, scalesOf, ticksOf } from "../src/editor/scales.js";
import { commandOf } from "../src/local/command.js";
import { decoded, encoded } from "../src/local/packing.js";
import { presetsOf } from "../src/paraview.js";
import { hashOf, kDefaults, sceneOf, startOf } from "../src/scene.js";
import { bytesText, shortText } from "../src/text.js";
import { colorAt, mixed, opacityAt, stretched, withAddedPoint, withInvertedColors, withPoint, withRange } from "../src/transfer.js";

const near = (a, b, tolerance = 1e-12) => a.forEach((v, i) => assert.ok(Math.abs(v - b[i]) <= tolerance, `${a} is not ${b}`));
const kRamp = { space: "RGB", colors: [[0, 0, 0, 0], [2, 1, 0.5, 0]], opacity: [[0, 0, 0.5, 0], [1, 0.5, 0.5, 0], [2, 1, 0.5, 0]] };

test("colors are interpolated between points and constant outside", () => {
  near(colorAt(kRamp, 1), [0.5, 0.25, 0]);
  near(colorAt(kRamp, -1), [0, 0, 0]);
  near(colorAt(kRamp, 5), [1, 0.5, 0]);
});

test("color spaces mix as their definitions say", () => {
  near(mixed("HSV", [1, 0, 0], [0, 0, 1], 0.5), [0, 1, 0]); // hues 0 and 2/3: 1/3
  near(mixed("HSVWrap", [1, 0, 0], [0, 0, 1], 0.5), [1, 0, 1]); // hues 1 and 2/3: 5/6
  near(mixed("Lab", [0, 0, 0], [1, 1, 1], 0.5), [0.466, 0.466, 0.466], 1e-3); // L* = 50 in sRGB
  // Moreland's cool to warm is light grey in its middle.
  near(mixed("Diverging", [0.230, 0.299, 0.754], [0.706, 0.016, 0.150], 0.5), [0.865, 0.865, 0.865], 2e-3);
  near(mixed("Step", [1, 0, 0], [0, 0, 1], 0.3), [0, 0, 1]);
});

test("midpoint and sharpness bend the opacity", () => {
  assert.equal(opacityAt(kRamp.opacity, 0.5), 0.25);
  assert.equal(opacityAt([[0, 0, 0.25, 0], [1, 1, 0.5, 0]], 0.25), 0.5);
  assert.equal(opacityAt([[0, 0, 0.5, 1], [1, 1, 0.5, 0]], 0.49), 0);
  assert.equal(opacityAt([[0, 0, 0.5, 1], [1, 1, 0.5, 0]], 0.51), 1);
  const soft = opacityAt([[0, 0, 0.5, 0.5], [1, 1, 0.5, 0]], 0.25);
  assert.ok(soft > 0 && soft < 0.25);
});

test("points keep their order", () => {
  assert.equal(withPoint(kRamp.opacity, 1, [9, 0.5, 0.5, 0])[1][0], 2);
  assert.equal(withPoint(kRamp.opacity, 1, [-9, 0.5, 0.5, 0])[1][0], 0);
  assert.equal(withAddedPoint(kRamp.opacity, [1.5, 0.1, 0.5, 0]).index, 2);
});

test("a range moves all points, and inverting twice changes nothing", () => {
  assert.deepEqual(withRange(kRamp, [10, 14]).opacity.map((p) => p[0]), [10, 12, 14]);
  assert.deepEqual(withInvertedColors(withInvertedColors(kRamp)), kRamp);
  assert.deepEqual(stretched([[5, 1]], [5, 5], [1, 2]), [[1, 1]]);
});

/** @type {any} */
const kCamera = { eye: [3, 2, 9], center: [1, 1, 1], up: [0, 1, 0], fov: 30 };
const distanceOf = ({ eye, center }) => Math.hypot(...eye.map((v, i) => v - center[i]));

test("turning keeps the center and the distance, also over the poles", () => {
  let camera = kCamera;
  for (let i = 0; i < 50; ++i) camera = orbited(camera, 0.3, 0.2);
  assert.deepEqual(camera.center, kCamera.center);
  assert.ok(Math.abs(distanceOf(camera) - distanceOf(kCamera)) < 1e-9);
  near([camera.eye[0], camera.eye[2]], [1, 1], 1e-6); // above the center
  const back = orbited(orbited(kCamera, 0.4, 0), -0.4, 0);
  near(back.eye, kCamera.eye);
});

test("zooming at a place of the picture keeps what is there", () => {
  const size = { width: 200, height: 100 }, place = /** @type {any} */ ([2, 1.5, 1]);
  const parallel = withParallelRays(kCamera, true);
  const before = projectionOf(parallel, size)(place);
  const [x, y] = [(before[0] - 100) / 100, (50 - before[1]) / 100];
  near(projectionOf(zoomedAt(parallel, 3, x, y), size)(place), before, 1e-9);
});

test("parallel rays and perspective show the center in one size", () => {
  const parallel = withParallelRays(kCamera, true);
  assert.ok(Math.abs(heightAtCenter(parallel) - heightAtCenter(kCamera)) < 1e-12);
  near(withParallelRays(parallel, false).eye, kCamera.eye, 1e-9);
  assert.ok(Math.abs(heightAtCenter(zoomed(kCamera, 2)) - heightAtCenter(kCamera) / 2) < 1e-12);
});

test("a shift moves the picture by its share of the height", () => {
  const size = { width: 100, height: 100 };
  near(projectionOf(panned(kCamera, 0.25, 0.1), size)(/** @type {any} */ (kCamera.center)), [75, 40], 1e-9);
});

test("the fine axis has a place for 0 and room for small opacities", () => {
  const scales = scalesOf({ width: 300, height: 200 }, [0, 1], "fine");
  for (const opacity of kOpacityTicks.fine) assert.ok(Math.abs(scales.opacityAt(scales.y(opacity)) - opacity) < 1e-12);
  assert.ok(scales.y(0) - scales.y(0.001) > 0.09 * scales.height);
});

test("ticks are round numbers within the range", () => {
  assert.deepEqual(ticksOf([0, 5.7], 4), [0, 2, 4]);
  assert.deepEqual(ticksOf([-1, 1], 4), [-1, -0.5, 0, 0.5, 1]);
  assert.deepEqual(ticksOf([3, 3], 4), [3]);
});

test("numbers are short", () => {
  assert.deepEqual([0, 0.5, 1.23456, 1e-5, 1234567].map((v) => shortText(v)), ["0", "0.5", "1.235", "1e-5", "1.23e+6"]);
  assert.deepEqual([12, 50216, 2511715].map(bytesText), ["12 bytes", "50.2 KB", "2.51 MB"]);
});

const kGrid = { name: "density", defaultLook: { ...kRamp, range: [0, 2] }, box: [[0, 0, 0], [9, 9, 9]] };
/** @type {any} */
const kDescription = { files: [{ name: "a", frames: [], grids: [kGrid] }, { name: "b", frames: [4, 5], grids: [kGrid] }] };

test("a link gives the scene back, without members that are usual", () => {
  const scene = { ...startOf(kDescription, 1, 0), camera: kCamera, frame: 5, step: 2 };
  const hash = hashOf(scene, kDescription);
  assert.deepEqual(sceneOf(hash, kDescription), scene);
  assert.ok(!hash.includes("mode"));
});

test("members of a link that are wrong have their usual values", () => {
  const usual = startOf(kDescription, 0, 0);
  for (const hash of ["#file=7", "#step=-1", "#transfer={}", "#camera={}", "#frame=3", '#compare={"file":9}', "#clip=[[1,2,3]]", "#%"])
    assert.deepEqual(sceneOf(hash, kDescription), usual, hash);
});

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
