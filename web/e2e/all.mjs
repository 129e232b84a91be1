// Every case, one after the other: node e2e/all.mjs [NAME …]
import { spawnSync } from "node:child_process";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const folder = join(fileURLToPath(import.meta.url), "../cases");
const wanted = process.argv.slice(2);
let failed = 0;
for (const file of readdirSync(folder).sort()) {
  if (!file.endsWith(".mjs") || (wanted.length > 0 && !wanted.some((name) => file.includes(name)))) continue;
  console.log(`== ${file}`);
  const { status } = spawnSync(process.execPath, [join(folder, file)], { stdio: "inherit" });
  if (status !== 0 && status !== 77) failed += 1;
}
process.exit(failed > 0 ? 1 : 0);
