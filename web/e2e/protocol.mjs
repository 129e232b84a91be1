// Compares what the program sends with the description of it in src/protocol/protocol.ts: runs the tests of the server,
// whose path is the argument, and checks every message that they got. "Skipped" where the packages are not installed.
import { spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const web = resolve(fileURLToPath(import.meta.url), "../..");
const vitest = join(web, "node_modules/vitest/vitest.mjs");
const tests = process.argv[2];
if (!existsSync(vitest) || !tests || !existsSync(tests)) {
  console.log("skipped: the packages are not installed (npm ci in web/), or there is no studio_test");
  process.exit(77);
}
const folder = mkdtempSync(join(tmpdir(), "sentree-protocol-"));
process.on("exit", () => rmSync(folder, { recursive: true, force: true }));
const env = { ...process.env, SENTREE_MESSAGES: join(folder, "messages") };
const run = (program, args) => {
  const { status } = spawnSync(program, args, { cwd: web, stdio: "inherit", env });
  if (status !== 0) process.exit(status ?? 1);
};
run(tests, ["--gtest_brief=1", "--gtest_filter=StudioServer.*:Attached.*"]);
run(process.execPath, [vitest, "run", "src/protocol/messages.test.ts"]);
