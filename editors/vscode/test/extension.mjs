// The extension as people install it: built, packed, and what must be in it is there. extension.mjs FOLDER
import { spawnSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import assert from "node:assert/strict";

const folder = dirname(dirname(fileURLToPath(import.meta.url)));
const out = process.argv[2];
if (!existsSync(join(folder, "node_modules/@vscode/vsce"))) {
  console.log("skipped: the packages are not installed (npm ci in editors/vscode/)");
  process.exit(77);
}
mkdirSync(out, { recursive: true });
const vsix = join(out, "sentree.vsix");
rmSync(vsix, { force: true });
const packed = spawnSync("npm", ["run", "--silent", "package", "--", "--out", vsix], { cwd: folder, encoding: "utf8" });
assert.equal(packed.status, 0, packed.stdout + packed.stderr);
for (const file of ["extension/dist/extension.js", "extension/syntaxes/requirements.tmLanguage.json"])
  assert.ok(readFileSync(vsix).includes(file), `${file} is in the package`);
assert.ok(!readFileSync(vsix).includes("node_modules/"), "and no package beside it");
assert.ok(statSync(vsix).size < 1 << 20, "it stays small");

// Every command that a code lens names, the extension has.
const manifest = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
const commands = manifest.contributes.commands.map((command) => command.command);
for (const command of ["sentree.run", "sentree.test", "sentree.studio", "sentree.show"]) assert.ok(commands.includes(command));
const bundle = readFileSync(join(folder, "dist/extension.js"), "utf8");
for (const command of commands) assert.ok(bundle.includes(`"${command}"`), `${command} is registered`);
console.log("the extension is packed");
