// Runs the tests: bundles each src/**/*.test.ts(x) into build/tests/ and gives them to Node's own runner.
// Names of folders or files after the command run only those: `npm test src/connection`.
import { build } from "esbuild";
import { spawnSync } from "node:child_process";
import { readdir, rm } from "node:fs/promises";
import path from "node:path";

const ROOT = path.dirname(import.meta.dirname);
const OUT = path.join(ROOT, "build/tests");

const wanted = process.argv.slice(2);
const files = (await readdir(path.join(ROOT, "src"), { recursive: true }))
  .map((file) => path.join("src", file))
  .filter((file) => /\.test\.tsx?$/.test(file))
  .filter((file) => wanted.length === 0 || wanted.some((part) => file.startsWith(path.normalize(part))));
if (files.length === 0) {
  console.error(`No tests in ${wanted.join(", ") || "src"}.`);
  process.exit(1);
}

await rm(OUT, { recursive: true, force: true });
await build({
  absWorkingDir: ROOT,
  entryPoints: files,
  outdir: OUT,
  outbase: "src",
  outExtension: { ".js": ".mjs" },
  bundle: true,
  format: "esm",
  platform: "node",
  target: ["node20"],
  jsx: "automatic",
  jsxImportSource: "preact",
  loader: { ".css": "empty" },
  sourcemap: "inline",
  logLevel: "warning",
});
const built = files.map((file) => path.join(OUT, path.relative("src", file).replace(/\.tsx?$/, ".mjs")));
const { status } = spawnSync(process.execPath, ["--enable-source-maps", "--test", "--test-reporter=dot", ...built], { stdio: "inherit" });
process.exit(status ?? 1);
