// Builds the page into dist/: app.js, components.js, book.js, book_static.js, assistant.js, styles, index.html, licences.json. Fails where it grows too large.
import { build, context } from "esbuild";
import { cp, mkdir, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { gzipSync } from "node:zlib";
import path from "node:path";

const ROOT = import.meta.dirname;
const DIST = path.join(ROOT, "dist");
const MOST_BYTES = 250_000; // of all files together, as a browser receives them: compressed with gzip
const ENTRIES = {
  app: "src/app.tsx",
  components: "src/components/index.ts",
  book: "src/book/index.tsx",
  assistant: "src/assistant/embed.tsx",
};
const STATIC = { book_static: "src/book/static.ts" }; // a page that is opened as a file may load no module

const watching = process.argv.includes("--watch");
const shared = {
  absWorkingDir: ROOT,
  outdir: DIST,
  bundle: true,
  target: ["es2022"],
  jsx: "automatic",
  jsxImportSource: "preact",
  minify: !watching,
  sourcemap: watching ? "inline" : false,
  legalComments: "none", // licences.json has every text in full
  metafile: true,
  logLevel: "warning",
};
const options = {
  ...shared,
  entryPoints: pointsOf(ENTRIES),
  format: "esm",
  splitting: true, // what the page and the elements share is in one file
  chunkNames: "chunk-[hash]",
};

await rm(DIST, { recursive: true, force: true });
await mkdir(DIST, { recursive: true });
for (const file of ["index.html", "icon.svg"]) await cp(path.join(ROOT, "src", file), path.join(DIST, file));
if (watching) {
  await (await context(options)).watch();
} else {
  const { metafile } = await build(options);
  await preloadChunks(metafile);
  await build({ ...shared, entryPoints: pointsOf(STATIC), format: "iife" });
  // The elements take the page's own styles, and a book without a server those of one with it.
  for (const name of ["components.css", "book_static.css"]) await rm(path.join(DIST, name), { force: true });
  await writeFile(path.join(DIST, "licences.json"), JSON.stringify(await licences(metafile)));
  await reportSizes();
}

function pointsOf(entries) {
  return Object.entries(entries).map(([out, file]) => ({ in: file, out }));
}

/** Names in index.html what app.js imports: the browser loads it beside app.js, and not after it. */
async function preloadChunks({ outputs }) {
  const imported = outputs["dist/app.js"].imports.filter(({ kind }) => kind === "import-statement");
  const links = imported.map((each) => `<link rel="modulepreload" href="${path.basename(each.path)}" />\n    `);
  const file = path.join(DIST, "index.html");
  await writeFile(file, (await readFile(file, "utf8")).replace("<script", `${links.join("")}<script`));
}

/** The name, version, licence and licence text of every package of which a byte is in the bundles. */
async function licences(metafile) {
  const folders = new Set();
  for (const output of Object.values(metafile.outputs)) {
    for (const [file, { bytesInOutput }] of Object.entries(output.inputs)) {
      const folder = /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(file)?.[1];
      if (folder !== undefined && bytesInOutput > 0) folders.add(folder);
    }
  }
  return Promise.all([...folders].sort().map((folder) => licenceOf(path.join(ROOT, folder))));
}

async function licenceOf(folder) {
  const { name, version, license } = JSON.parse(await readFile(path.join(folder, "package.json"), "utf8"));
  const file = (await readdir(folder)).find((entry) => /^(licen[cs]e|copying)(\.(md|txt))?$/i.test(entry));
  if (file === undefined) throw new Error(`${name} ships no licence text: the page must not bundle it.`);
  return { name, version, licence: license, text: await readFile(path.join(folder, file), "utf8") };
}

async function reportSizes() {
  let all = 0;
  for (const file of (await readdir(DIST)).sort()) {
    const bytes = gzipSync(await readFile(path.join(DIST, file)), { level: 9 }).length;
    all += bytes;
    console.log(`${file.padEnd(16)} ${(bytes / 1000).toFixed(1).padStart(7)} kB compressed`);
  }
  console.log(`${"all".padEnd(16)} ${(all / 1000).toFixed(1).padStart(7)} kB of at most ${MOST_BYTES / 1000} kB`);
  if (all > MOST_BYTES) {
    console.error("The page is too large: find what grew with esbuild's --analyze, or raise the limit in a decision.");
    process.exitCode = 1;
  }
}
