// Monitors that were not put to the test are listed as such, at the end of a run and in its recording.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, text, until } from "../harness/browser.mjs";
import { example, run, scratch, serve, serve_run } from "../harness/program.mjs";

const project = example("recharge");
const scenario = "no-path";

async function shown(page) {
  const found = {};
  for (const monitor of await page.locator("[data-monitor]").all()) {
    const vacuity = monitor.getByTestId("vacuity");
    if ((await vacuity.count()) > 0) found[await monitor.getAttribute("data-monitor")] = await vacuity.innerText();
  }
  return found;
}

test("what was not put to the test is listed", async () => {
  const recording = join(scratch(), "run.mcap");
  const done = await run(["run", project, "--scenario", scenario, "--clock", "virtual", "--json", "--record", recording]);
  const report = JSON.parse(done.stdout);
  const expected = Object.fromEntries(report.monitors.filter((monitor) => monitor.vacuity).map((monitor) => [monitor.monitor, `It ${monitor.vacuity}.`]));
  assert.ok(Object.keys(expected).length > 0, "the scenario leaves a monitor without a test");
  for (const show of [() => serve_run(project, { scenario, args: ["--clock", "virtual", "--factor", "1000"] }), () => serve(["studio", recording])]) {
    const program = await show();
    const { page, close } = await open_page(program.url);
    await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
    await until(async () => (await page.getByTestId("vacuity").count()) > 0, "the list says so");
    assert.deepEqual(await shown(page), expected);
    await close();
    await program.stop();
  }
});
