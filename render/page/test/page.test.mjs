// The page as a whole: sizes of windows, themes, keys, screen readers, and the end of the server.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bench, openPage, rested, serve, unfold } from "./support.mjs";

const shared = bench();
const kSections = ["Colors and opacity", "Rendering", "Cut", "Compare", "Statistics"];

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
  assert.equal(await dialog.count(), 0);
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
