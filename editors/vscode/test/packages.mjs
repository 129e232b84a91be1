// Gets the packages of package-lock.json, or says "skipped" where they cannot be had.
import { spawnSync } from "node:child_process";
import { existsSync, statSync, utimesSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const folder = dirname(dirname(fileURLToPath(import.meta.url)));
const installed = join(folder, "node_modules/.package-lock.json");
const lock = join(folder, "package-lock.json");
if (!existsSync(installed) || statSync(lock).mtimeMs > statSync(installed).mtimeMs) {
  // No package needs a script of its own to work.
  const npm = spawnSync("npm", ["ci", "--ignore-scripts", "--no-audit", "--no-fund", "--prefer-offline"], {
    cwd: folder,
    stdio: "inherit",
  });
  if (npm.status !== 0) {
    console.log("skipped: the packages cannot be installed (npm ci in editors/vscode/)");
    process.exit(77);
  }
  utimesSync(installed, new Date(), new Date());
}
