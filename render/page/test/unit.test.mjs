// The page's arithmetic, without a browser. Tolerances: float64 arithmetic of a few operations loses
// less than 1e-12 of numbers about 1; colors of tables are given with three digits.
import assert from "node:assert/strict";
import { test } from "node:test";
import { heightAtCenter, orbited, panned, withParallelRays, zoomed, zoomedAt } from "../src/camera/orbit.js";
import { projectionOf } from "../src/camera/projection.js";
import { kOpacityTicks, scalesOf, ticksOf } from "../src/editor/scales.js";
import { mixed } from "../src/look/color-spaces.js";
import { bytesText, shortText } from "../src/look/number-text.js";
import { colorAt, opacityAt, stretched, withAddedPoint, withInvertedColors, withPoint, withRange } from "../src/look/transfer.js";
import { hashOf, sceneOf } from "../src/state/link.js";
import { startOf } from "../src/state/scene.js";

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
