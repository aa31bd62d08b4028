// The controls beside the editor.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bench, changeBy, differenceOf, litShare, openPage, pictureOf, rested, sceneOf, unfold } from "./support.mjs";

const shared = bench();
const kVisible = 0.05; // mean change of a picture, in 255ths

const enter = async (field, text) => {
  await field.fill(text);
  await field.press("Enter");
};

test("each control of the rendering changes the scene, and those that should change the picture do", async (t) => {
  const page = await openPage(t, shared);
  const section = await unfold(page, "Rendering");
  const changes = [
    ["mode", "maximum", true, () => section.getByLabel("Show").selectOption("maximum")],
    ["mode", "average", true, () => section.getByLabel("Show").selectOption("average")],
    ["mode", undefined, true, () => section.getByLabel("Show").selectOption("composite")],
    ["opacityLength", 8, true, () => enter(section.getByLabel("Opacity length"), "8")],
    ["step", 3, false, () => enter(section.getByLabel("Step along a ray"), "3")],
    ["shade", true, true, () => section.getByLabel("Light surfaces").check()],
    ["background", [1, 1, 1], true, () => section.getByLabel("Background").fill("#ffffff")],
    ["background", undefined, true, () => section.getByLabel("Transparent in PNG files").check()],
    ["classification", "post", false, () => section.getByLabel("Colors between samples").selectOption("post")],
    ["lod", "off", false, () => section.getByLabel("Levels of detail").selectOption("off")],
    ["between", "sum", false, () => section.getByLabel("Values between voxels").selectOption("sum")],
  ];
  for (const [name, value, visible, act] of changes) {
    const change = await changeBy(page, act);
    assert.deepEqual(sceneOf(page)[name], value, name);
    if (visible) assert.ok(change > kVisible, `${name}: ${change}`);
  }
});

test("the clip box cuts by numbers, by handles and by keys", async (t) => {
  const page = await openPage(t, shared);
  const section = await unfold(page, "Cut");
  assert.ok((await changeBy(page, () => section.getByRole("radio", { name: "Clip box" }).check())) < kVisible, "the whole volume is inside");
  const handles = page.getByRole("slider", { name: /^Clip box/ });
  assert.equal(await handles.count(), 6);
  const [low, high] = sceneOf(page).clip;
  const middle = (low[1] + high[1]) / 2;
  const field = section.getByRole("group", { name: "Y" }).getByLabel("to");
  assert.ok((await changeBy(page, () => enter(field, String(middle)))) > kVisible);
  assert.equal(sceneOf(page).clip[1][1], middle);
  const handle = page.getByRole("slider", { name: "Clip box: lower end of x" });
  const box = await handle.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 15, box.y + box.height / 2, { steps: 4 });
  await page.mouse.up();
  await rested(page);
  const dragged = sceneOf(page).clip[0][0];
  assert.ok(dragged > low[0]);
  await handle.focus();
  await page.keyboard.press("ArrowRight");
  await rested(page);
  assert.ok(sceneOf(page).clip[0][0] > dragged);
  await section.getByRole("button", { name: "Reset the box" }).click();
  await rested(page);
  assert.deepEqual(sceneOf(page).clip, [low, high]);
  await section.getByRole("radio", { name: "Whole volume" }).check();
  await rested(page);
  assert.equal(sceneOf(page).clip, undefined);
});

test("a slice is shown along each axis and moved by its slider", async (t) => {
  const page = await openPage(t, shared);
  const section = await unfold(page, "Cut");
  assert.ok((await changeBy(page, () => section.getByRole("radio", { name: "Slice" }).check())) > kVisible);
  for (const axis of ["X", "Y", "Z"]) {
    await section.getByRole("radio", { name: axis, exact: true }).check();
    await rested(page);
    assert.equal(sceneOf(page).slice.axis, axis.toLowerCase());
  }
  const before = sceneOf(page).slice.place;
  await section.getByRole("slider", { name: "Place of the slice" }).press("ArrowRight");
  await rested(page);
  assert.equal(sceneOf(page).slice.place, before + 0.5);
  await enter(section.getByRole("textbox", { name: "Place" }), "7");
  await rested(page);
  assert.equal(sceneOf(page).slice.place, 7);
});

async function compared(t, hash = "") {
  const page = await openPage(t, shared, { hash });
  const section = await unfold(page, "Compare");
  await section.getByLabel("Reference", { exact: true }).first().selectOption({ label: "smoke.vdb: density" });
  await rested(page);
  return { page, section };
}

test("the border between volume and reference moves without a new picture", async (t) => {
  const { page } = await compared(t);
  const divider = page.getByRole("slider", { name: "Border between the volume and the reference" });
  const box = await divider.boundingBox();
  let drawn = 0;
  const devtools = await page.context().newCDPSession(page);
  await devtools.send("Network.enable");
  devtools.on("Network.webSocketFrameSent", () => ++drawn);
  await page.mouse.move(box.x + box.width / 2, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x - 150, box.y + 200, { steps: 5 });
  await page.mouse.up();
  await rested(page);
  assert.equal(drawn, 0);
  const { split } = sceneOf(page).compare;
  assert.ok(split < 0.4, `${split}`);
  await divider.press("ArrowRight");
  await rested(page);
  assert.ok(Math.abs(sceneOf(page).compare.split - split - 0.02) < 1e-9);
  assert.match(await page.locator(".surface canvas").nth(1).evaluate((c) => c.style.clipPath), /inset/);
});

test("reference and difference are shown, with the PSNR of the picture", async (t) => {
  const { page, section } = await compared(t);
  const own = await pictureOf(page);
  await section.getByRole("radio", { name: "Reference" }).check();
  await rested(page);
  const reference = await pictureOf(page);
  const difference = differenceOf(own, reference);
  assert.ok(difference > 0 && difference < 10, "alike, but not equal");
  const psnr = await section.getByText(/ dB$/).innerText();
  assert.ok(parseFloat(psnr) > 15, psnr);
  await section.getByRole("radio", { name: "Difference" }).check();
  await rested(page);
  const gain = section.getByLabel("Difference multiplied by");
  assert.ok((await changeBy(page, () => enter(gain, "100"))) > kVisible);
  await section.getByLabel("Reference", { exact: true }).first().selectOption("none");
  await rested(page);
  assert.ok(differenceOf(await pictureOf(page), own) < 0.01);
});

test("another volume is chosen with its own look and view", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("radio", { name: "Inferno" }).check();
  await rested(page);
  const before = sceneOf(page).camera;
  await page.getByLabel("Volume", { exact: true }).selectOption({ label: "rising.esvr: density" });
  await rested(page);
  const scene = sceneOf(page);
  assert.equal(scene.file, 2);
  assert.equal(scene.transfer, undefined, "the usual look");
  assert.notDeepEqual(scene.camera, before);
  assert.ok(litShare(await pictureOf(page)) > 0.02);
  await page.getByRole("group", { name: "Sequence" }).waitFor();
});

test("statistics tell what the volume is and how fast it is drawn", async (t) => {
  const page = await openPage(t, shared);
  const section = await unfold(page, "Statistics");
  const facts = Object.fromEntries(await section.locator("dl div").evaluateAll((rows) => rows.map((row) => [...row.children].map((c) => c.textContent))));
  assert.equal(facts["Ellipsoids"], "300");
  assert.match(facts["Bytes of the file"], /KB$/);
  assert.match(facts["Drawn on"], /CPU/);
  assert.match(facts["Time until it was shown"], / ms$/);
});

test("a sequence is shown frame by frame, and played", async (t) => {
  const page = await openPage(t, shared, { hash: "#file=2&grid=0" });
  const bar = page.getByRole("group", { name: "Sequence" });
  assert.ok((await changeBy(page, () => bar.getByRole("slider", { name: "Frame" }).press("ArrowRight"))) > kVisible);
  assert.equal(sceneOf(page).frame, 2);
  await bar.getByRole("button", { name: "Next frame" }).click();
  await rested(page);
  assert.equal(sceneOf(page).frame, 3);
  await bar.getByRole("button", { name: "Frame before" }).click();
  await rested(page);
  assert.equal(sceneOf(page).frame, 2);
  await bar.getByLabel("Speed").selectOption("30");
  const seen = new Set();
  await bar.getByRole("button", { name: "Play" }).click();
  for (let i = 0; i < 60 && seen.size < 3; ++i) {
    seen.add(await bar.locator("output").innerText());
    await page.waitForTimeout(50);
  }
  await bar.getByRole("button", { name: "Pause" }).click();
  assert.equal(seen.size, 3, "all frames were played");
});
