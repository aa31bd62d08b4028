// Bundles each page into one HTML file: `node build.mjs` writes dist/, `node build.mjs --check` fails
// if dist/ is not what it would write.
import { build } from "esbuild";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";

const root = dirname(fileURLToPath(import.meta.url));
const pages = [{ entry: "src/main-view.js", out: "dist/view.html" }];

/** Bundles an entry point and what it imports. */
function bundle(entry) {
  return build({
    absWorkingDir: root,
    entryPoints: [entry],
    bundle: true,
    minify: true,
    format: "iife",
    target: ["es2022"],
    jsx: "automatic",
    jsxImportSource: "preact",
    loader: { ".html": "text" },
    legalComments: "none",
    charset: "utf8",
    metafile: true,
    outdir: "dist",
    write: false,
  });
}

/** The text of a page: a template whose places are filled with the style and the script. */
async function pageText(result) {
  const template = await readFile(join(root, "src/page.html"), "utf8");
  const textOf = (ending) => result.outputFiles.find((f) => f.path.endsWith(ending)).text.trim();
  // A function as the second argument, because '$' has a meaning in a replacement text.
  return template
    .replace("/* STYLE */", () => textOf(".css"))
    .replace("/* SCRIPT */", () => textOf(".js"));
}

/** Folders of the packages that a bundle contains. */
function packagesOf(metafile) {
  const inputs = Object.keys(metafile.inputs);
  const folder = /^node_modules\/((?:@[^/]+\/)?[^/]+)\//;
  return new Set(inputs.map((path) => path.match(folder)?.[1]).filter(Boolean));
}

async function licenseOf(name) {
  const folder = join(root, "node_modules", name);
  const { version, license } = JSON.parse(await readFile(join(folder, "package.json"), "utf8"));
  const text = await readFile(join(folder, "LICENSE"), "utf8");
  return `${name} ${version} (${license})\n\n${text.trim()}\n`;
}

async function licensesText(names) {
  const texts = await Promise.all([...names].sort().map(licenseOf));
  return ["The pages in this folder contain these packages.\n", ...texts].join("\n");
}

async function outputs() {
  const files = new Map();
  const names = new Set();
  for (const { entry, out } of pages) {
    const result = await bundle(entry);
    files.set(out, await pageText(result));
    packagesOf(result.metafile).forEach((name) => names.add(name));
  }
  return files.set("dist/licenses.txt", await licensesText(names));
}

async function isUpToDate(path, text) {
  const stored = await readFile(path, "utf8").catch(() => null);
  if (stored !== text) console.error(`${relative(root, path)} is out of date: run node build.mjs`);
  return stored === text;
}

async function check(files) {
  const results = [];
  for (const [path, text] of files) results.push(await isUpToDate(join(root, path), text));
  process.exitCode = results.every(Boolean) ? 0 : 1;
}

async function write(files) {
  await mkdir(join(root, "dist"), { recursive: true });
  for (const [path, text] of files) await writeFile(join(root, path), text);
  for (const [path, text] of files) console.log(`${path}: ${Buffer.byteLength(text)} bytes`);
}

await (process.argv.includes("--check") ? check : write)(await outputs());
