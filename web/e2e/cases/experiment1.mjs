// The paper's first experiment, by hand: the battery is forced to 10 % while the robot is on its way.
import assert from "node:assert/strict";
import { test } from "node:test";

import { first_message, open_page, operate, shown_time, text, until, verdicts } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

test("a battery forced to 10 % is a violation that no one can miss", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);

  assert.equal(await page.getByTestId("violation-banner").count(), 0);
  assert.deepEqual([...new Set(Object.values(await verdicts(page)))], ["undecided"]);
  await operate(page, "intervene", { call: "simulation.setBatteryCharge", args: { percent: 10 } });

  const banner = page.getByTestId("violation-banner");
  await banner.waitFor();
  assert.equal(await banner.getAttribute("role"), "alert");
  const box = await banner.boundingBox();
  assert.ok(box.width >= 1400, "the banner is as wide as the page");
  await until(async () => (await verdicts(page)).never_empty === "violated" && (await verdicts(page)).battery === "violated", "both monitors are violated");

  // The witness: a click on an observation goes to its moment, in every panel.
  await page.getByTestId("violation-why").click();
  const line = page.getByTestId("violation-story").locator(".witness-line").last();
  const moment = await line.locator("time").innerText();
  await line.click();
  await page.getByTestId("past-strip").waitFor();
  await until(async () => (await text(page, "clock")) === moment, "the clock shows the moment of the observation");
  assert.equal(await text(page, "presence"), "◀ Past");

  // A moment before the violation, nothing is violated.
  await page.keyboard.press(",");
  await until(async () => (await verdicts(page)).never_empty === "undecided", "before the violation the verdict is undecided");
  await page.keyboard.press("n");
  await until(async () => (await verdicts(page)).never_empty === "violated", "N goes to the violation");

  // The chart of the hand-drawn monitor stands in `failure`.
  const model = await first_message(page, "model");
  const chart = model.charts.find((candidate) => candidate.id === "monitor:battery");
  const state = await first_message(page, "state");
  const active = state.charts["monitor:battery"].active.map((index) => chart.states[index].id);
  assert.ok(active.includes("failure"), `active: ${active}`);

  await page.keyboard.press("Escape");
  await page.getByTestId("violation-story").waitFor({ state: "detached" });
  assert.equal(await banner.count(), 1, "Escape puts the story away, not the strip");

  const before = await shown_time(page);
  await page.keyboard.press("l");
  await page.getByTestId("past-strip").waitFor({ state: "detached" });
  assert.ok((await shown_time(page)) >= before);
  await close();
  await program.stop();
});
