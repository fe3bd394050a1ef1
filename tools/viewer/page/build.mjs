// Writes the page to a folder: node build.mjs DIR makes DIR/index.html, DIR/view.js and DIR/view.css.
import { copyFile, mkdir } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const target = process.argv[2];
if (!target || process.argv.length > 3) {
  console.error("usage: node build.mjs DIR");
  process.exit(2);
}
const folder = resolve(target);

await mkdir(folder, { recursive: true });
await build({
  entryPoints: { view: join(here, "src/main.ts") },
  outdir: folder,
  bundle: true,
  minify: true,
  format: "esm",
  target: ["chrome100", "firefox100", "safari15.4"],
  legalComments: "eof",
  logLevel: "warning",
});
await copyFile(join(here, "src/index.html"), join(folder, "index.html"));
