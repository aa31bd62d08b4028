// The panels and the sequence, and the page as a whole: sizes of windows, themes, keys, screen readers, and the end of
// the server.
import assert from "node:assert/strict";
import { test } from "node:test";
import { becomes, bench, changeBy, differenceOf, litShare, openPage, pictureOf, rested, sceneOf, serve, unfold } from "./support.mjs";

const shared = bench();
const kSections = ["Colors and opacity", "Rendering", "Cut", "Compare", "Statistics"];
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
  await becomes(() => handles.count(), 6);
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

for (const colorScheme of ["light", "dark"])
  test(`nothing is cut off at any width, ${colorScheme}`, async (t) => {
    const page = await openPage(t, shared, { viewport: { width: 390, height: 900 }, colorScheme });
    for (const title of kSections) await unfold(page, title);
    for (const width of [390, 820, 1280, 2560]) {
      await page.setViewportSize({ width, height: 900 });
      await rested(page);
      const cut = await page.evaluate(() => {
        const isCut = ({ right, left }) => right > innerWidth + 1 || left < -1;
        const controls = [...document.querySelectorAll("button, input:not([hidden]), select, textarea, svg, h2")];
        return controls.filter((c) => c.getClientRects().length > 0 && isCut(c.getBoundingClientRect())).map((c) => c.outerHTML.slice(0, 80));
      });
      assert.deepEqual(cut, [], `${width} pixels`);
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth > innerWidth), false, `${width} pixels`);
    }
  });

test("every control has a name for screen readers", async (t) => {
  const page = await openPage(t, shared, { hash: "#file=2&grid=0" });
  for (const title of kSections) await unfold(page, title);
  await page.getByRole("radio", { name: "Clip box" }).check();
  const devtools = await page.context().newCDPSession(page);
  const { nodes } = await devtools.send("Accessibility.getFullAXTree");
  const roles = new Set(["button", "slider", "textbox", "combobox", "radio", "checkbox", "application", "ColorWell", "spinbutton"]);
  const unnamed = nodes.filter((n) => !n.ignored && roles.has(n.role?.value) && !n.name?.value);
  assert.deepEqual(unnamed.map((n) => n.role.value), []);
  assert.ok(nodes.filter((n) => roles.has(n.role?.value)).length > 50);
});

test("the keyboard alone reaches every kind of control", async (t) => {
  const page = await openPage(t, shared);
  const seen = new Set();
  for (let i = 0; i < 80; ++i) {
    await page.keyboard.press("Tab");
    seen.add(await page.evaluate(() => {
      const e = document.activeElement;
      return e.getAttribute("aria-label") ?? e.labels?.[0]?.textContent ?? e.textContent;
    }));
  }
  const all = [...seen].join("\n");
  for (const name of ["Save picture", "Help", "Picture of the volume", "View from +X", "Opacity point 1 of 2", "Viridis", "Rendering", "Statistics"])
    assert.ok(all.includes(name), name);
});

test("a focused control is seen", async (t) => {
  const page = await openPage(t, shared);
  await page.keyboard.press("Tab");
  assert.notEqual(await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle), "none");
});

test("the theme is chosen, and kept", async (t) => {
  const page = await openPage(t, shared, { colorScheme: "dark" });
  const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const dark = await background();
  await page.getByRole("button", { name: /^Theme/ }).click();
  const light = await background();
  assert.notEqual(light, dark);
  await page.reload();
  await page.locator(".viewer").waitFor();
  assert.equal(await background(), light);
});

test("help lists mouse, touch and keys, and is closed by Escape", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("button", { name: "Help" }).click();
  const dialog = page.getByRole("dialog", { name: "Mouse, touch and keys" });
  await dialog.getByText("Wheel, or pinch").waitFor();
  await page.keyboard.press("Escape");
  await becomes(() => dialog.count(), 0);
});

test("nothing moves by itself where motion is not wanted", async (t) => {
  const page = await openPage(t, shared, { reducedMotion: "reduce" });
  const animations = await page.evaluate(() => document.getAnimations().length);
  assert.equal(animations, 0);
});

test("the link is copied", async (t) => {
  const page = await openPage(t, shared);
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.getByText("The link to this view is on the clipboard.").waitFor();
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), page.url());
});

test("the page says that the server has ended", async (t) => {
  const server = await serve([shared.files.fitted]);
  const page = await openPage(t, shared, { url: server.url, expectErrors: true });
  server.stop();
  await page.getByRole("alert").getByText("The connection to esvr-view has ended").waitFor();
});

test("a scene that cannot be drawn is named, and the next one is drawn", async (t) => {
  const page = await openPage(t, shared);
  await page.goto(page.url().split("#")[0] + "#clip=" + encodeURIComponent("[[5,5,5],[1,1,1]]"));
  await page.reload();
  await page.getByRole("alert").getByText("clip").waitFor();
  await unfold(page, "Cut");
  await page.getByRole("radio", { name: "Whole volume" }).check();
  await rested(page);
  assert.equal(await page.getByRole("alert").innerText(), "");
});
