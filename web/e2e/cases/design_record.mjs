// A run of the project that is edited, begun and steered in its page, and recorded beside it.
import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { begin_run, open_beside, records, rename_node, stop_run } from "../harness/beside.mjs";
import { interventions, text, until } from "../harness/browser.mjs";
import { copy_of, open_design, serve_design, settled } from "../harness/design.mjs";
import { run } from "../harness/program.mjs";

const recordings = (page) => page.locator("[data-recording]").evaluateAll((rows) => rows.map((row) => row.dataset.recording));

async function record(page, how) {
  await begin_run(page, how);
  await until(async () => (await text(page, "presence")) === "● Live", "the run goes on");
  return records(page);
}

test("a run is recorded while it is steered, stopped, listed and opened; editing goes on beside it", async () => {
  const { folder, program, page, close } = await open_beside("recharge", "normal");
  assert.deepEqual(await recordings(page), []);

  const file = await record(page, "In step with the clock");
  assert.match(file, /^normal-.*\.mcap$/);
  await page.locator("h1", { hasText: "normal" }).waitFor();
  // It is steered as any run.
  await page.getByTestId("battery-robot").fill("60");
  await until(async () => (await interventions(page)).some((one) => /setBatteryCharge/.test(one)), "what was done by hand is observed");
  await page.getByTestId("pause").click();
  await until(async () => (await text(page, "presence")) === "❚❚ Paused", "the run is paused");

  // An edit is checked and run in the shadow; the page keeps showing the run.
  await rename_node(page, "AtKitchen", "InKitchen");
  assert.equal(await page.locator("[data-recording][aria-current=true]").getAttribute("data-recording"), file);
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator('[data-testid=tree] [aria-label^="AtKitchen"]').waitFor();
  assert.equal(await page.getByRole("button", { name: "Record a run of the scenario" }).count(), 0, "one at a time");
  await stop_run(page);

  // The shadow run comes back, and the recording beside it.
  await page.getByTestId("to-shadow").click();
  await page.locator('[data-testid=tree] [aria-label^="InKitchen"]').waitFor();
  await page.getByRole("button", { name: "Design", exact: true }).click();
  assert.deepEqual(await recordings(page), [file]);
  await page.locator(`[data-recording="${file}"]`).click();
  await page.locator('[data-testid=tree] [aria-label^="AtKitchen"]').waitFor();
  assert.ok((await interventions(page)).some((one) => /setBatteryCharge/.test(one)), "the recording has what was done");

  // Another page, which looks at a moment of what is over, follows as well.
  const other = await open_design(program.url);
  await other.page.getByRole("button", { name: "Run", exact: true }).click();
  await other.page.getByRole("button", { name: "−1 tick" }).click();
  await until(async () => (await text(other.page, "presence")) === "◀ Past", "it looks at the past");
  // The next one runs what is edited, saved or not; ended by its scenario it is over too.
  const second = await record(page, "Sixteen times as fast");
  await page.locator('[data-testid=tree] [aria-label^="InKitchen"]').waitFor();
  await until(async () => (await text(other.page, "presence")) !== "◀ Past", "the other page shows the run that goes on");
  await other.close();
  await stop_run(page);
  await page.getByRole("button", { name: "Design", exact: true }).click();
  assert.deepEqual((await recordings(page)).sort(), [file, second].sort());
  await close();
  assert.equal(await program.stop(), 0);
  assert.deepEqual(readdirSync(join(folder, "runs")).sort(), [file, second].sort());
  const info = await run(["info", join(folder, "runs", file)]);
  assert.equal(info.code, 0, info.stderr);
  assert.match(info.stdout, /normal/);
  // As it was recorded, it can be done again.
  const again = await run(["replay", join(folder, "runs", file)]);
  assert.equal(again.code, 0, again.stdout + again.stderr);
});

test("the program ends in order while a run is recorded, and the recording is whole", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await page.getByTestId("design-tree").waitFor();
  await settled(page);
  const file = await record(page, "In real time, with threads");
  await close();
  assert.equal(await program.stop(), 0);
  const info = await run(["info", join(folder, "runs", file)]);
  assert.equal(info.code, 0, info.stderr);
  assert.doesNotMatch(info.stdout + info.stderr, /cut off|not closed|in part/);
});
