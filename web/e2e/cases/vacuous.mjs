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
  const live = () => serve_run(project, { scenario, args: ["--clock", "virtual", "--factor", "1000"] });
  const recorded = () => serve(["studio", recording]);
  for (const [show, presence] of [[live, "■ Ended"], [recorded, "◼ Recording"]]) {
    const program = await show();
    const { page, close } = await open_page(program.url);
    await until(async () => (await text(page, "presence")) === presence, presence);
    await page.keyboard.press("End");
    await until(async () => (await page.getByTestId("vacuity").count()) > 0, "the list says so");
    assert.deepEqual(await shown(page), expected);
    const line = await page.getByTestId("vacuity").first().boundingBox();
    assert.ok(line.width > 100 && line.height > 8, "it can be read");
    if (process.env.SENTREE_PICTURES) await page.screenshot({ path: join(process.env.SENTREE_PICTURES, `vacuous-${presence.slice(2)}.png`) });
    await close();
    await program.stop();
  }
});
