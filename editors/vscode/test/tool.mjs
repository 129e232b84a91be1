// Runs a program of a package, or says "skipped" where the packages are not installed: tool.mjs PACKAGE/FILE ARGUMENTS…
import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const folder = dirname(dirname(fileURLToPath(import.meta.url)));
const [tool, ...given] = process.argv.slice(2);
const file = join(folder, "node_modules", tool);
if (!existsSync(file)) {
  console.log("skipped: the packages are not installed (npm ci in editors/vscode/)");
  process.exit(77);
}
process.exit(spawnSync(process.execPath, [file, ...given], { cwd: folder, stdio: "inherit" }).status ?? 1);
