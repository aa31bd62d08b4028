// The picture: that it is the one of esvr-render, and that mouse, touch and keys turn it.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { bench, changeBy, differenceOf, litShare, openPage, pictureOf, pixelsOf, rested, run, sceneOf } from "./support.mjs";

const shared = bench();
const kJpegError = 2; // in 255ths: JPEG of high quality on smooth pictures
const kVisible = 0.2;

/** Runs a command line of esvr-render that the page shows. */
function runCommand(text, folder) {
  const words = text.match(/'[^']*'|\S+/g).map((word) => word.replace(/^'|'$/g, ""));
  run("ESVR_RENDER", [...words.slice(1), "--force", "--device", "cpu"], { cwd: folder });
  return readFileSync(join(folder, "picture.png"));
}

const commandOf = async (page) => {
  await page.getByRole("button", { name: "Save picture" }).click();
  const text = await page.getByRole("textbox", { name: "Command" }).inputValue();
  await page.getByRole("button", { name: "Close" }).click();
  return text;
};

const surface = (page) => page.getByRole("application");

test("the first picture is not blank", async (t) => {
  const page = await openPage(t, shared);
  assert.ok(litShare(await pictureOf(page)) > 0.05);
});

test("the picture is the one of the command that the page shows", async (t) => {
  const page = await openPage(t, shared);
  const png = runCommand(await commandOf(page), shared.folder);
  assert.ok(differenceOf(await pictureOf(page), await pixelsOf(page, png)) < kJpegError);
});

const kSettings = {
  transfer: {
    space: "Lab",
    colors: [[0, 0.1, 0.2, 0.4], [0.7, 1, 0.9, 0.6]],
    opacity: [[0, 0, 0.5, 0], [0.2, 0.02, 0.4, 0.3], [0.7, 0.9, 0.5, 0]],
  },
  opacityLength: 2, step: 0.5, shade: true, background: [0.2, 0.3, 0.4], clip: [[14, 5, 14], [30, 40, 33]],
};

test("the command makes the picture with other settings, too", async (t) => {
  const hash = "#" + new URLSearchParams(Object.entries(kSettings).map(([name, value]) => [name, JSON.stringify(value)]));
  const page = await openPage(t, shared, { hash });
  await page.getByRole("button", { name: "Save picture" }).click();
  const [download] = await Promise.all([
    page.waitForEvent("download"), page.getByRole("button", { name: "Save transfer.json" }).click(),
  ]);
  await download.saveAs(join(shared.folder, "transfer.json"));
  await page.getByRole("button", { name: "Close" }).click();
  const drawn = await pictureOf(page), made = await pixelsOf(page, runCommand(await commandOf(page), shared.folder));
  assert.ok(differenceOf(drawn, made) < kJpegError);
  const usual = await openPage(t, shared);
  assert.ok(differenceOf(drawn, await pictureOf(usual)) > 5 * kJpegError, "the settings matter");
});

test("a downloaded PNG has the pixels of esvr-render", async (t) => {
  const page = await openPage(t, shared);
  const command = await commandOf(page);
  await page.getByRole("button", { name: "Save picture" }).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save PNG" }).click()]);
  const saved = await pixelsOf(page, readFileSync(await download.path()));
  assert.equal(differenceOf(saved, await pixelsOf(page, runCommand(command, shared.folder))), 0);
});

test("the command is copied to the clipboard", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("button", { name: "Save picture" }).click();
  await page.getByRole("button", { name: "Copy command" }).click();
  assert.match(await page.evaluate(() => navigator.clipboard.readText()), /^esvr-render .*smoke\.esvr/);
});

test("the size of a saved picture can be chosen", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("button", { name: "Save picture" }).click();
  await page.getByRole("textbox", { name: "Width" }).fill("120");
  await page.getByRole("textbox", { name: "Height" }).fill("80");
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save PNG" }).click()]);
  const { width, height } = await pixelsOf(page, readFileSync(await download.path()));
  assert.deepEqual([width, height], [120, 80]);
});

async function dragBy(page, dx, dy, options = {}) {
  const box = await surface(page).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down(options);
  await page.mouse.move(x + dx, y + dy, { steps: 5 });
  await page.mouse.up(options);
}

test("a drag turns the camera about its center", async (t) => {
  const page = await openPage(t, shared);
  const before = sceneOf(page).camera;
  assert.ok((await changeBy(page, () => dragBy(page, 120, 30))) > kVisible);
  const after = sceneOf(page).camera;
  assert.deepEqual(after.center, before.center);
  const distance = ({ eye, center }) => Math.hypot(...eye.map((v, i) => v - center[i]));
  assert.ok(Math.abs(distance(after) - distance(before)) < 1e-6 * distance(before));
});

test("a drag to the right moves what is in front to the right", async (t) => {
  const page = await openPage(t, shared);
  const right = ({ eye, center, up }) => {
    const f = center.map((v, i) => v - eye[i]);
    return [f[1] * up[2] - f[2] * up[1], f[2] * up[0] - f[0] * up[2], f[0] * up[1] - f[1] * up[0]];
  };
  const before = sceneOf(page).camera;
  await dragBy(page, 60, 0);
  await rested(page);
  const moved = sceneOf(page).camera.eye.map((v, i) => v - before.eye[i]);
  assert.ok(right(before).reduce((sum, r, i) => sum + r * moved[i], 0) < 0, "the eye moves to the left");
});

test("the camera stops above the volume", async (t) => {
  const page = await openPage(t, shared);
  for (let i = 0; i < 3; ++i) await dragBy(page, 0, 250);
  await rested(page);
  const { eye, center, up } = sceneOf(page).camera;
  assert.ok(eye[1] > center[1]);
  assert.ok(up[1] > -1e-6);
});

for (const [name, options, key] of [["the right button", { button: "right" }], ["Shift", {}, "Shift"]])
  test(`a drag with ${name} shifts the camera`, async (t) => {
    const page = await openPage(t, shared);
    const before = sceneOf(page).camera;
    if (key) await page.keyboard.down(key);
    await dragBy(page, 50, 0, options);
    if (key) await page.keyboard.up(key);
    await rested(page);
    const after = sceneOf(page).camera;
    const shift = (place) => after[place].map((v, i) => v - before[place][i]);
    shift("eye").forEach((v, i) => assert.ok(Math.abs(v - shift("center")[i]) < 1e-6));
    assert.ok(Math.hypot(...shift("eye")) > 1);
  });

test("the wheel zooms, and a double click shows all again", async (t) => {
  const page = await openPage(t, shared);
  const fitted = sceneOf(page).camera;
  const box = await surface(page).boundingBox();
  await page.mouse.move(box.x + 200, box.y + 200);
  assert.ok((await changeBy(page, () => page.mouse.wheel(0, -400))) > kVisible);
  await page.mouse.dblclick(box.x + 200, box.y + 200);
  await rested(page);
  const again = sceneOf(page).camera;
  fitted.eye.forEach((v, i) => assert.ok(Math.abs(v - again.eye[i]) < 1e-6));
});

test("keys turn, shift, zoom and fit", async (t) => {
  const page = await openPage(t, shared);
  await surface(page).focus();
  for (const key of ["ArrowLeft", "ArrowUp", "Shift+ArrowRight", "+", "-"]) {
    const before = JSON.stringify(sceneOf(page).camera);
    await page.keyboard.press(key);
    await rested(page);
    assert.notEqual(JSON.stringify(sceneOf(page).camera), before, key);
  }
  await page.keyboard.press("0");
  await rested(page);
  assert.deepEqual(sceneOf(page).camera.up, [0, 1, 0]);
});

test("one finger turns, and two fingers zoom", async (t) => {
  const page = await openPage(t, shared, { hasTouch: true });
  const devtools = await page.context().newCDPSession(page);
  const touch = (type, points) => devtools.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const before = sceneOf(page).camera;
  await touch("touchStart", [[300, 300]]);
  await touch("touchMove", [[380, 300]]);
  await touch("touchEnd", []);
  await rested(page);
  const turned = sceneOf(page).camera;
  assert.deepEqual(turned.center, before.center);
  assert.notDeepEqual(turned.eye, before.eye);
  await touch("touchStart", [[280, 300], [320, 300]]);
  await touch("touchMove", [[200, 300], [400, 300]]);
  await touch("touchEnd", []);
  await rested(page);
  const distance = ({ eye, center }) => Math.hypot(...eye.map((v, i) => v - center[i]));
  assert.ok(distance(sceneOf(page).camera) < 0.5 * distance(turned));
});

test("each view looks along its axis", async (t) => {
  const page = await openPage(t, shared);
  for (const [text, axis, sign] of [["+X", 0, 1], ["−X", 0, -1], ["+Y", 1, 1], ["−Y", 1, -1], ["+Z", 2, 1], ["−Z", 2, -1]]) {
    await page.getByRole("button", { name: `View from ${text}` }).click();
    await rested(page);
    const { eye, center } = sceneOf(page).camera;
    const arm = eye.map((v, i) => v - center[i]);
    assert.ok(sign * arm[axis] > 0.999 * Math.hypot(...arm), text);
    assert.ok(litShare(await pictureOf(page)) > 0.02, text);
  }
});

test("parallel rays keep the size at the center", async (t) => {
  const page = await openPage(t, shared);
  const change = await changeBy(page, () => page.getByRole("button", { name: "Parallel" }).click());
  const { height, fov } = sceneOf(page).camera;
  assert.ok(height > 0 && fov === undefined);
  assert.ok(change > 0 && change < 10);
  assert.equal(await page.getByRole("button", { name: "Parallel" }).getAttribute("aria-pressed"), "true");
});

test("a link reproduces the view", async (t) => {
  const page = await openPage(t, shared);
  await dragBy(page, 90, 20);
  await rested(page);
  await page.getByRole("radio", { name: "Inferno" }).check();
  await rested(page);
  const other = await openPage(t, shared, { hash: new URL(page.url()).hash });
  assert.equal(differenceOf(await pictureOf(page), await pictureOf(other)), 0);
});

test("an address that is changed by hand shows what it says", async (t) => {
  const page = await openPage(t, shared);
  const before = sceneOf(page).camera;
  await page.evaluate(() => (location.hash = "#file=1&grid=0&step=2"));
  await rested(page);
  const { file, step, camera } = sceneOf(page);
  assert.deepEqual([file, step], [1, 2]);
  assert.ok(Math.abs(camera.eye[0] - before.eye[0]) < 3, "the view is fitted to a volume of the same size");
  assert.ok(litShare(await pictureOf(page)) > 0.05);
});

test("a damaged link shows the usual view", async (t) => {
  const usual = await openPage(t, shared);
  for (const hash of ["#camera=1&transfer=[]&file=99", "#clip={}&step=%22x%22&compare=7&background=[1]", "#%%%"]) {
    const page = await openPage(t, shared, { hash });
    assert.ok(differenceOf(await pictureOf(page), await pictureOf(usual)) < 0.01, hash);
  }
});

test("never more than one picture is asked for at a time, and the last one is complete", async (t) => {
  const page = await openPage(t, shared, { locale: "en-US" }); // in a tab of its own
  const open = new Set();
  let most = 0, moving = 0;
  page.on("websocket", () => assert.fail("the page uses one connection"));
  const devtools = await page.context().newCDPSession(page);
  await devtools.send("Network.enable");
  devtools.on("Network.webSocketFrameSent", ({ response }) => {
    const message = JSON.parse(response.payloadData);
    if (message.type !== "draw") return;
    moving += message.moving;
    open.add(message.id);
    most = Math.max(most, open.size);
  });
  devtools.on("Network.webSocketFrameReceived", ({ response }) => {
    if (response.opcode !== 2) return;
    const bytes = Buffer.from(response.payloadData, "base64");
    open.delete(JSON.parse(bytes.subarray(4, 4 + bytes.readUInt32LE(0)).toString()).id);
  });
  for (let i = 0; i < 5; ++i) await dragBy(page, 60, 20);
  await rested(page);
  assert.equal(most, 1);
  assert.ok(moving > 3, "drags draw pictures");
});
