// Bundles src/main.js and src/batch.js into ../static. Their first line names the digest of what it was made of; a test compares it.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync, mkdirSync } from "node:fs";
import { build } from "esbuild";

const digest = createHash("sha256");
for (const name of readdirSync("src").sort()) digest.update(`${name}\n`).update(readFileSync(`src/${name}`));
digest.update(readFileSync("package-lock.json"));
const sum = digest.digest("hex");
mkdirSync("../static", { recursive: true });
for (const [entry, name] of [["main", "report"], ["batch", "batch"]]) {
  const made = await build({
    entryPoints: [`src/${entry}.js`], bundle: true, minify: true, format: "iife", target: "es2022", write: false,
    legalComments: "inline", loader: { ".css": "text" },
  });
  const code = made.outputFiles[0].text.replaceAll("</script", "<\\/script");
  writeFileSync(`../static/${name}.js`, `// made by build.mjs of ${sum}\n${code}`);
  console.log(`${name}.js: ${(code.length / 1e3).toFixed(0)} kB`);
}
