// Builds the module of the exported page with Emscripten: `node make_wasm.mjs` writes decoder.wasm,
// `node make_wasm.mjs --check` fails if it is not what it would write.
import { spawnSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url)), root = join(here, "../..");
const folder = join(root, "build/wasm"), stored = join(here, "decoder.wasm");
/** The version that decoder.wasm was built with; others give other bytes. */
const kVersion = "3.1.6";

function skip(why) {
  console.log(`skipped: decoder.wasm is not checked, because ${why}`);
  process.exit(0);
}

function run(command, ...args) {
  const { status, stdout, stderr } = spawnSync(command, args, { cwd: root, encoding: "utf8" });
  if (status !== 0) throw new Error(`${command} ${args.join(" ")} failed:\n${stdout}${stderr}`);
}

const found = spawnSync("emcc", ["--version"], { encoding: "utf8" });
const checks = process.argv.includes("--check");
if (checks && found.error) skip("there is no emcc");
if (checks && !found.stdout.includes(kVersion)) skip(`emcc is not version ${kVersion}`);

const options = ["-DESVR_DECODER_ONLY=ON", "-DESVR_BUILD_TESTS=OFF", "-DCMAKE_BUILD_TYPE=MinSizeRel"];
run("emcmake", "cmake", "-S", root, "-B", folder, "-G", "Ninja", ...options);
run("cmake", "--build", folder);
// emcc has run this optimiser once. The second run makes the compressed module 1 % smaller.
const built = join(folder, "libesvr/page/page.wasm"), small = join(folder, "decoder.wasm");
const features = ["simd", "exception-handling", "bulk-memory", "sign-ext", "mutable-globals", "nontrapping-float-to-int"];
run("wasm-opt", "-Oz", ...features.map((feature) => `--enable-${feature}`), built, "-o", small);
const bytes = readFileSync(small);
if (!checks) writeFileSync(stored, bytes), console.log(`decoder.wasm: ${bytes.length} bytes`);
else if (!readFileSync(stored).equals(bytes)) {
  console.error("decoder.wasm is out of date: run node make_wasm.mjs");
  process.exitCode = 1;
}
