// Bundles the page's sources into `built`, which the wheel carries; the same sources give the same bytes.
import { build } from "esbuild";
import { copyFile, mkdir, readFile, rm, writeFile } from "node:fs/promises";

const out = process.argv[2] ?? "built";
await rm(out, { recursive: true, force: true });
await mkdir(out, { recursive: true });
await build({
  entryPoints: { page: "src/app.tsx" },
  outdir: out,
  bundle: true,
  format: "esm",
  target: "es2022",
  minify: true,
  legalComments: "none", // the licences are in a file of their own
  jsx: "automatic",
  jsxImportSource: "preact",
  logLevel: "warning",
});
await copyFile("src/index.html", `${out}/index.html`);
await copyFile("src/icon.svg", `${out}/icon.svg`);
const { dependencies } = JSON.parse(await readFile("package.json", "utf8"));
const licences = [];
for (const [name, version] of Object.entries(dependencies).sort()) {
  const text = await readFile(`node_modules/${name}/LICENSE`, "utf8");
  licences.push(`${name} ${version}\n\n${text.trim()}\n`);
}
await writeFile(`${out}/licences.txt`, licences.join(`\n${"-".repeat(72)}\n\n`));
