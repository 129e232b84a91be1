// The page of each scenario shows what the scenario's report says.
import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, text, until, verdicts } from "../harness/browser.mjs";
import { example, run, serve_run } from "../harness/program.mjs";

const project = example("recharge");
const scenarios = readdirSync(join(project, "scenarios"))
  .map((file) => file.replace(/\.yaml$/, ""))
  // Its parts are processes: real time, whose ends differ from run to run.
  .filter((name) => name !== "distributed");

for (const scenario of scenarios) {
  test(scenario, async () => {
    const done = await run(["run", project, "--scenario", scenario, "--clock", "virtual", "--json", "--no-record"]);
    const report = JSON.parse(done.stdout);
    const program = await serve_run(project, { scenario, args: ["--clock", "virtual", "--factor", "1000"] });
    const { page, close } = await open_page(program.url);
    await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
    const badge = await text(page, "mission-status");
    assert.ok(badge.startsWith(report.mission), `the header says ${badge}, the report ${report.mission}`);
    if (report.reason) assert.ok(badge.includes(report.reason), `${badge} has the reason ${report.reason}`);
    const expected = Object.fromEntries(report.monitors.map((monitor) => [monitor.monitor, monitor.verdict]));
    assert.deepEqual(await verdicts(page), expected);
    const violated = report.monitors.filter((monitor) => monitor.verdict === "violated");
    assert.equal(await page.getByTestId("violation-banner").count(), violated.length > 0 ? 1 : 0);
    await close();
    await program.stop();
  });
}
