// Bundles each page into one HTML file, and the style and the script of the pages of esvr-compare:
// `node build.mjs` writes dist/ and programs/dist/, `node build.mjs --check` fails if they are not
// what it would write.
import { build } from "esbuild";
import { decoded, encoded } from "./src/local/packing.js";
import { gunzipSync, gzipSync } from "node:zlib";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";

const root = dirname(fileURLToPath(import.meta.url));
const pages = [
  { entry: "src/main-view.js", out: "dist/view.html", fill: viewPage },
  { entry: "src/main-export.js", out: "dist/export.html", fill: exportPage },
];

/** The pages of esvr-compare, which the program writes. */
const report = "../../programs";

/** `import text from "worker:./file.js"` gives the bundled text of a worker. */
const workers = {
  name: "workers",
  setup({ onResolve, onLoad }) {
    onResolve({ filter: /^worker:/ }, ({ path, resolveDir }) => ({
      path: join(resolveDir, path.replace("worker:", "")),
      namespace: "worker",
    }));
    onLoad({ filter: /./, namespace: "worker" }, async ({ path }) => {
      const { outputFiles } = await bundle(path);
      return { contents: outputFiles[0].text, loader: "text" };
    });
  },
};

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
    plugins: [workers],
    nodePaths: [join(root, "node_modules")], // for the report, which is in another folder
    legalComments: "none",
    charset: "utf8",
    metafile: true,
    outdir: "dist",
    write: false,
  });
}

const textOf = (result, ending) => result.outputFiles.find((f) => f.path.endsWith(ending)).text.trim();

/** A template of which places are filled. */
async function filled(template, parts) {
  let text = await readFile(join(root, template), "utf8");
  // A function as the second argument, because '$' has a meaning in a replacement text.
  for (const [place, part] of Object.entries(parts)) text = text.replace(`/* ${place} */`, () => part);
  return text;
}

/** The page of esvr-view: the style and the script as they are. */
function viewPage(result) {
  return filled("src/page.html", { STYLE: textOf(result, ".css"), SCRIPT: textOf(result, ".js") });
}

const packed = (bytes) => encoded(gzipSync(bytes, { level: 9 }));

/** The exported page: the style and the script are compressed, since pages are sent to people. */
async function exportPage(result) {
  const style = JSON.stringify(textOf(result, ".css"));
  const program = `document.head.append(Object.assign(document.createElement("style"),{textContent:${style}}));`;
  const start = await bundle("src/local/start.js");
  return filled("src/export.html", {
    DECODER: packed(await readFile(join(root, "decoder.wasm"))),
    PROGRAM: packed(program + textOf(result, ".js")),
    START: textOf(start, ".js"),
  });
}

/** A page with its compressed parts unpacked, since versions of Node compress differently. */
function unpacked(text) {
  const packedPart = /(;gzip;base91">)([^<]*)/g;
  return text.replace(packedPart, (_, tag, part) => tag + gunzipSync(decoded(part)).toString("latin1"));
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
  for (const { entry, out, fill } of pages) {
    const result = await bundle(entry);
    files.set(out, await fill(result));
    packagesOf(result.metafile).forEach((name) => names.add(name));
  }
  files.set("dist/licenses.txt", await licensesText(names));
  return reportFiles(files);
}

/** Adds the style and the script of reports. The licenses stand in the script, so that each page has them. */
async function reportFiles(files) {
  const result = await bundle(`${report}/page.js`);
  const licenses = await Promise.all([...packagesOf(result.metafile)].sort().map(licenseOf));
  files.set(`${report}/dist/page.css`, textOf(result, ".css"));
  return files.set(`${report}/dist/page.js`, `/*\n${licenses.join("\n")}*/\n${textOf(result, ".js")}`);
}

async function isUpToDate(path, text) {
  const stored = await readFile(path, "utf8").catch(() => null);
  const same = stored !== null && unpacked(stored) === unpacked(text);
  if (!same) console.error(`${relative(root, path)} is out of date: run node build.mjs`);
  return same;
}

async function check(files) {
  const results = [];
  for (const [path, text] of files) results.push(await isUpToDate(join(root, path), text));
  process.exitCode = results.every(Boolean) ? 0 : 1;
}

async function write(files) {
  for (const folder of ["dist", `${report}/dist`]) await mkdir(join(root, folder), { recursive: true });
  for (const [path, text] of files) await writeFile(join(root, path), text);
  for (const [path, text] of files) console.log(`${path}: ${Buffer.byteLength(text)} bytes`);
}

await (process.argv.includes("--check") ? check : write)(await outputs());
