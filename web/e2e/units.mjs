// The unit tests, or "skipped" where the packages are not installed.
import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const web = resolve(fileURLToPath(import.meta.url), "../..");
const vitest = join(web, "node_modules/vitest/vitest.mjs");
if (!existsSync(vitest)) {
  console.log("skipped: the packages are not installed (npm ci in web/)");
  process.exit(77);
}
process.exit(spawnSync(process.execPath, [vitest, "run"], { cwd: web, stdio: "inherit" }).status ?? 1);
