// The editor of transfer functions: each change is one of the scene, and changes the picture.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { becomes, bench, changeBy, openPage, rested, sceneOf } from "./support.mjs";

const shared = bench();
const kVisible = 0.05; // mean change of a picture, in 255ths

const plot = (page) => page.getByRole("group", { name: "Opacity curve over the histogram" });
const points = (page) => page.getByRole("slider", { name: /^Opacity point/ });
const point = (page, index) => points(page).nth(index);
const opacityOf = (page) => sceneOf(page).transfer.opacity;

/** A place in the diagram, as shares of its width and height. */
async function placeIn(page, x, y) {
  const box = await plot(page).boundingBox();
  return [box.x + x * box.width, box.y + y * box.height];
}

const clickInto = async (page, x, y) => page.mouse.click(...(await placeIn(page, x, y)));

/** Opens the page with a third point in the middle of the curve. */
async function withThreePoints(t) {
  const page = await openPage(t, shared);
  await clickInto(page, 0.5, 0.3);
  await rested(page);
  return page;
}

test("a click adds a point where it is", async (t) => {
  const page = await openPage(t, shared);
  assert.ok((await changeBy(page, () => clickInto(page, 0.5, 0.3))) > kVisible);
  await becomes(() => points(page).count(), 3);
  const [low, [value, opacity], high] = opacityOf(page);
  assert.ok(value > low[0] && value < high[0]);
  assert.ok(opacity > 0.6 && opacity < 0.85, `${opacity}`);
});

test("a drag moves a point, and not beyond its neighbours", async (t) => {
  const page = await withThreePoints(t);
  const box = await point(page, 1).boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + 1000, box.y + 60, { steps: 4 });
  await page.mouse.up();
  await rested(page);
  const [, moved, last] = opacityOf(page);
  assert.equal(moved[0], last[0]);
});

test("Delete and a right click remove a point", async (t) => {
  const page = await withThreePoints(t);
  await point(page, 1).focus();
  await page.keyboard.press("Delete");
  await becomes(() => points(page).count(), 2);
  await clickInto(page, 0.4, 0.4);
  await point(page, 1).click({ button: "right" });
  await becomes(() => points(page).count(), 2);
});

test("a finger that taps adds a point, and one that scrolls does not", async (t) => {
  const page = await openPage(t, shared, { hasTouch: true, viewport: { width: 390, height: 700 } });
  await page.touchscreen.tap(...(await placeIn(page, 0.5, 0.4)));
  await becomes(() => points(page).count(), 3);
  const devtools = await page.context().newCDPSession(page);
  const [x, y] = await placeIn(page, 0.3, 0.8);
  const touch = (type, touchPoints) => devtools.send("Input.dispatchTouchEvent", { type, touchPoints });
  await touch("touchStart", [{ x, y }]);
  for (let i = 1; i < 6; ++i) await touch("touchMove", [{ x, y: y - 20 * i }]);
  await touch("touchEnd", []);
  await rested(page);
  await becomes(() => points(page).count(), 3);
  assert.ok((await page.evaluate(() => scrollY)) > 20);
});

test("arrow keys move a point, with Shift in finer steps", async (t) => {
  const page = await withThreePoints(t);
  await point(page, 1).focus();
  const steps = [];
  for (const key of ["ArrowDown", "Shift+ArrowDown", "ArrowRight"]) {
    const before = opacityOf(page)[1];
    await page.keyboard.press(key);
    await rested(page);
    steps.push(opacityOf(page)[1].map((v, i) => v - before[i]));
  }
  const [coarse, fine, right] = steps;
  assert.ok(coarse[1] < 0 && Math.abs(coarse[1] / fine[1] - 10) < 0.01);
  assert.ok(right[0] > 0);
});

test("numbers set the selected point", async (t) => {
  const page = await withThreePoints(t);
  await point(page, 1).focus();
  const group = page.getByRole("group", { name: "Opacity point 2 of 3" });
  for (const [name, text] of [["Value", "0.5"], ["Opacity", "0.01"], ["Midpoint", "0.25"], ["Sharpness", "0.5"]]) {
    await group.getByRole("textbox", { name }).fill(text);
    await page.keyboard.press("Enter");
  }
  await rested(page);
  assert.deepEqual(opacityOf(page)[1], [0.5, 0.01, 0.25, 0.5]);
});

test("wrong numbers change nothing, and large ones are limited", async (t) => {
  const page = await withThreePoints(t);
  const before = opacityOf(page);
  const field = page.getByRole("textbox", { name: "Opacity" }).first();
  await field.fill("abc");
  await field.press("Enter");
  assert.deepEqual(opacityOf(page), before);
  await field.fill("7");
  await field.press("Enter");
  await rested(page);
  assert.equal(opacityOf(page)[1][1], 1);
});

test("the fine axis gives small opacities more room", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("radio", { name: "Fine near 0" }).check();
  await clickInto(page, 0.5, 0.75);
  await rested(page);
  const [, [, opacity]] = opacityOf(page);
  assert.ok(opacity > 0 && opacity < 0.02, `${opacity}`);
});

test("the histogram counts linearly or by logarithm", async (t) => {
  const page = await openPage(t, shared);
  const outline = () => plot(page).locator(".histogram").getAttribute("d");
  const before = await outline();
  await page.getByRole("group", { name: "Histogram" }).getByRole("radio", { name: "Linear" }).check();
  assert.notEqual(await outline(), before);
});

test("the axis of values can be zoomed by buttons and by the wheel", async (t) => {
  const page = await openPage(t, shared);
  await becomes(() => points(page).count(), 2);
  await page.getByRole("button", { name: "Show fewer values" }).click();
  await becomes(() => points(page).count(), 0);
  await page.getByRole("button", { name: "Show more values" }).click();
  await becomes(() => points(page).count(), 2);
  await page.mouse.move(...(await placeIn(page, 0.5, 0.5)));
  await page.keyboard.down("Control");
  await page.mouse.wheel(0, -600);
  await page.keyboard.up("Control");
  await page.waitForFunction(() => document.querySelectorAll(".point").length === 0);
});

test("buttons step through, add and remove points", async (t) => {
  const page = await openPage(t, shared);
  const group = page.getByRole("group", { name: /^Opacity point \d/ });
  await group.getByRole("button", { name: "Add" }).click();
  await becomes(() => points(page).count(), 3);
  await page.getByRole("group", { name: "Opacity point 2 of 3" }).waitFor();
  await group.getByRole("button", { name: "Next" }).click();
  await page.getByRole("group", { name: "Opacity point 3 of 3" }).waitFor();
  await group.getByRole("button", { name: "Previous" }).click();
  await group.getByRole("button", { name: "Remove" }).click();
  await becomes(() => points(page).count(), 2);
});

test("each color map and opacity curve changes the picture", async (t) => {
  const page = await openPage(t, shared);
  for (const name of ["Inferno", "Cool to warm", "Grayscale", "CT bone", "Turbo"])
    assert.ok((await changeBy(page, () => page.getByRole("radio", { name, exact: true }).check())) > kVisible, name);
  for (const name of ["tent", "step", "inverse"])
    assert.ok((await changeBy(page, () => page.getByLabel("Opacity curve", { exact: true }).selectOption(name))) > kVisible, name);
});

test("inverting the colors twice gives the first colors", async (t) => {
  const page = await openPage(t, shared);
  const invert = () => page.getByRole("button", { name: "Invert colors" }).click();
  assert.ok((await changeBy(page, invert)) > kVisible);
  await invert();
  await rested(page);
  await becomes(() => page.getByRole("radio", { name: "Viridis" }).isChecked(), true);
});

test("the range moves all points", async (t) => {
  const page = await openPage(t, shared);
  const group = page.getByRole("group", { name: "Range of values" });
  await group.getByRole("textbox", { name: "to" }).fill("0.4");
  assert.ok((await changeBy(page, () => page.keyboard.press("Enter"))) > kVisible);
  assert.equal(opacityOf(page).at(-1)[0], 0.4);
  assert.equal(sceneOf(page).transfer.colors.at(-1)[0], 0.4);
  await group.getByRole("button", { name: "Use all values" }).click();
  await rested(page);
  assert.ok(opacityOf(page).at(-1)[0] > 0.4);
});

test("colors can be reduced to a few points, moved, changed, added and removed", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("button", { name: "Reduce to 9" }).click();
  const handles = page.getByRole("slider", { name: /^Color point/ });
  await becomes(() => handles.count(), 9);
  await handles.nth(4).focus();
  await page.keyboard.press("ArrowRight");
  const field = page.getByRole("group", { name: "Color point 5 of 9" }).getByLabel("Color");
  assert.ok((await changeBy(page, () => field.fill("#ff0000"))) > kVisible);
  assert.deepEqual(sceneOf(page).transfer.colors[4].slice(1), [1, 0, 0]);
  await page.getByRole("group", { name: /^Color point \d/ }).getByRole("button", { name: "Add" }).click();
  await becomes(() => handles.count(), 10);
  await handles.nth(5).focus();
  await page.keyboard.press("Delete");
  await becomes(() => handles.count(), 9);
});

test("changes are undone and done again", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("radio", { name: "Inferno" }).check();
  await rested(page);
  await page.keyboard.press("Control+z");
  await becomes(() => page.getByRole("radio", { name: "Viridis" }).isChecked(), true);
  await page.getByRole("button", { name: "Redo" }).click();
  await becomes(() => page.getByRole("radio", { name: "Inferno" }).isChecked(), true);
  await page.getByRole("button", { name: "Undo" }).click();
  await becomes(() => page.getByRole("radio", { name: "Viridis" }).isChecked(), true);
});

const kPresets = [
  { Name: "Red", ColorSpace: "RGB", RGBPoints: [0, 0, 0, 0, 2, 1, 0, 0], Points: [0, 0, 0.5, 0, 2, 1, 0.5, 0] },
  { Name: "Blue", ColorSpace: "RGB", RGBPoints: [0, 0, 0, 0, 2, 0, 0, 1], Points: [0, 0, 0.5, 0, 2, 1, 0.5, 0] },
];

test("a saved preset is a file of ParaView that can be opened again", async (t) => {
  const page = await withThreePoints(t);
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save preset" }).click()]);
  const path = await download.path(), before = sceneOf(page).transfer;
  const [preset] = JSON.parse(readFileSync(path, "utf8"));
  assert.deepEqual(preset.Points, before.opacity.flat());
  await page.getByLabel("Opacity curve", { exact: true }).selectOption("step");
  await page.getByLabel("ParaView preset").setInputFiles(path);
  await rested(page);
  const after = sceneOf(page).transfer;
  assert.equal(after.space, before.space);
  for (const name of ["colors", "opacity"])
    after[name].flat().forEach((v, i) => assert.ok(Math.abs(v - before[name].flat()[i]) < 1e-12));
});

test("one of several presets of a file can be chosen", async (t) => {
  const page = await openPage(t, shared);
  const path = join(shared.folder, "presets.json");
  writeFileSync(path, JSON.stringify(kPresets));
  await page.getByLabel("ParaView preset").setInputFiles(path);
  await page.getByLabel("Preset of the file").selectOption({ label: "Blue" });
  await rested(page);
  const [value, ...color] = sceneOf(page).transfer.colors.at(-1);
  assert.deepEqual(color, [0, 0, 1]);
  assert.notEqual(value, 2, "the range is as before");
  await page.getByRole("radio", { name: "Of the preset" }).check();
  await rested(page);
  assert.deepEqual(sceneOf(page).transfer.colors.at(-1), [2, 0, 0, 1]);
});

/** Drops a file onto the page. */
async function drop(page, name, text) {
  const data = await page.evaluateHandle(([n, content]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([content], n));
    return transfer;
  }, [name, text]);
  for (const type of ["dragover", "drop"]) await page.dispatchEvent(".viewer", type, { dataTransfer: data });
}

test("a preset that is dropped onto the page is shown", async (t) => {
  const page = await openPage(t, shared);
  await drop(page, "red.json", JSON.stringify(kPresets.slice(0, 1)));
  await page.getByRole("status").getByText('"Red"').waitFor();
  await rested(page);
  assert.deepEqual(sceneOf(page).transfer.colors.at(-1).slice(1), [1, 0, 0]);
});

test("a file that is no preset changes nothing, and the page says why", async (t) => {
  const page = await openPage(t, shared);
  await drop(page, "holiday.jpg", "no preset");
  await page.getByText(/^holiday\.jpg: .*not JSON/).waitFor();
  assert.equal(sceneOf(page).transfer, undefined);
});
