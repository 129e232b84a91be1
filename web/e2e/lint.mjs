// The linter over the page and its tests, or "skipped" where the packages are not installed.
import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const web = resolve(fileURLToPath(import.meta.url), "../..");
const eslint = join(web, "node_modules/eslint/bin/eslint.js");
if (!existsSync(eslint)) {
  console.log("skipped: the packages are not installed (npm ci in web/)");
  process.exit(77);
}
process.exit(spawnSync(process.execPath, [eslint, ".", "--max-warnings", "0"], { cwd: web, stdio: "inherit" }).status ?? 1);
