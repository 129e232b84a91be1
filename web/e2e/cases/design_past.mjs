// A requirement that is being written says what it would have said of the last runs.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { text, until } from "../harness/browser.mjs";
import { copy_of, open_design, serve_design } from "../harness/design.mjs";
import { program as sentree } from "../harness/program.mjs";

const kNew = "never_below: always level >= 30 %.";

test("a requirement shows when the last runs would have violated it, as monitor check has it", async () => {
  const folder = copy_of("recharge");
  for (const scenario of ["experiment1", "normal"]) {
    spawnSync(sentree, ["run", folder, "--scenario", scenario, "--clock", "virtual", "--record", join(folder, "runs", `${scenario}.mcap`)]);
  }
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "requirements/recharge.req" });
  const run_of = (requirement, run) => page.locator(`[data-requirement="${requirement}"][data-past-run="${run}"]`);
  await run_of("never_empty", "experiment1").waitFor();
  assert.notEqual(await run_of("never_empty", "experiment1").getAttribute("data-violated"), "");
  assert.equal(await run_of("never_empty", "normal").getAttribute("data-violated"), "");

  const section = page.getByTestId("requirement-blocks").getByRole("region", { name: "never_empty" });
  await section.getByText("The chart that watches for it").click();
  await section.getByRole("img", { name: "Chart of never_empty" }).getByText("violated").waitFor();

  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+End");
  await page.keyboard.type(`\n${kNew}`);
  const began = Date.now();
  await run_of("never_below", "experiment1").waitFor();
  console.log(`# from the last letter to the past: ${Date.now() - began} ms`);
  await page.keyboard.press("Control+s");
  await page.locator('[data-file="requirements/recharge.req"][data-dirty=false]').waitFor();
  const file = join(folder, "requirements/recharge.req");
  for (const run of readdirSync(join(folder, "runs"))) {
    const checked = spawnSync(sentree, ["monitor", "check", join(folder, "runs", run), "--req", file, "--json"], { encoding: "utf8" });
    const monitor = JSON.parse(checked.stdout).monitors.find(({ monitor: name }) => name === "never_below");
    const expected = monitor.verdict === "violated" ? String(Math.round(monitor.time * 1e9)) : "";
    await until(async () => (await run_of("never_below", run.replace(".mcap", "")).getAttribute("data-violated")) === expected, `${run} as monitor check has it (${expected})`);
    // And so it stands on the timeline.
    if (expected === "") continue;
    const mark = page.locator(`[data-past-mark="${expected}"]`, { hasText: `never_below is violated in runs/${run.replace(".mcap", "")}` });
    await until(async () => (await mark.count()) === 1, `${run} is marked on the timeline`);
  }
  // The blocks and the last runs are at the requirement that is written; its moment is shown in that run.
  const new_section = page.getByTestId("requirement-blocks").getByRole("region", { name: "never_below" });
  await until(() => new_section.evaluate((element) => element.getBoundingClientRect().top < element.closest(".requirement-blocks").getBoundingClientRect().bottom - 40), "its blocks are in sight");
  const violated = Number(await run_of("never_below", "experiment1").getAttribute("data-violated"));
  await run_of("never_below", "experiment1").getByRole("button").click();
  await page.getByTestId("shadow").getByText("experiment1.mcap").waitFor();
  await until(async () => (await text(page, "design-clock")) === `0:${(violated / 1e9).toFixed(3)}`, "the moment is shown");
  await close();
  await program.stop();
});

test("where requirements were never readable it is said that they are not, and no run is waited for", async () => {
  const folder = copy_of("recharge");
  writeFileSync(join(folder, "requirements/recharge.req"), "never_empty: always (.\n");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "requirements/recharge.req" });
  await page.locator(".design-right").getByText(/^What the last runs would have said is told once /).waitFor();
  await close();
  await program.stop();
});
