// The header fits on every screen, whatever runs beside the project; what a sign stands for is still read aloud.
import assert from "node:assert/strict";
import { test } from "node:test";

import { sticks_out } from "../harness/browser.mjs";
import { copy_of, node, open_design, serve_design, settled } from "../harness/design.mjs";

for (const [width, height] of [[1440, 900], [1366, 768], [1024, 700]]) test(`the header fits beside a run that is steered, edited and ended, at ${width}×${height}`, async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url, { width, height });
  const fits = async (when) => {
    assert.ok(await page.locator(".header").evaluate((header) => header.scrollWidth <= header.clientWidth), `${when}: the header is too wide`);
    assert.deepEqual(await sticks_out(page), [], when);
  };
  const view = (name) => page.getByRole("button", { name, exact: true }).click();
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption("experiment1");
  await settled(page);
  await page.getByRole("button", { name: "Record" }).click();
  await page.getByRole("menuitem").first().click();
  await page.getByTestId("records").waitFor();
  await fits("it runs");
  await page.getByTestId("pause").click();
  await page.getByTestId("presence").getByText("Paused").waitFor();
  await fits("it is paused");
  await view("Design");
  // What is noted lies over nothing.
  await page.getByTestId("autosave").click();
  await page.getByTestId("autosave").click();
  await page.locator(".header .note", { hasText: "saved by Ctrl+S" }).waitFor();
  await fits("something is noted");
  const covered = await page.evaluate(() => {
    const notes = [...document.querySelectorAll(".note")].map((note) => note.getBoundingClientRect());
    const others = [...document.querySelectorAll("button, select")].filter((one) => one.checkVisibility() && !one.closest(".note"));
    const lies_over = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
    return others.filter((one) => notes.some((note) => lies_over(note, one.getBoundingClientRect()))).map(({ textContent }) => textContent);
  });
  assert.deepEqual(covered, []);
  await node(page, "BatteryLevelAbove30").click();
  await page.locator("#design-port-threshold").fill("35");
  await page.keyboard.press("Enter");
  await page.getByTestId("apply").waitFor();
  await view("Run");
  await fits("edits can be applied");
  await page.getByTestId("apply").click();
  await page.getByTestId("before-edits").waitFor();
  await fits("the edits are applied");
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await page.locator("dialog[open]").getByRole("button", { name: "Stop" }).click();
  await page.getByTestId("presence").getByText("Ended").waitFor();
  await page.getByRole("button", { name: "Record" }).waitFor();
  await fits("it has ended");
  assert.equal(await page.getByTestId("pause").count(), 0);
  // Words and signs alike.
  for (const name of [/^Find/, "Dark", "Help", "Shadow run"]) await page.getByRole("button", { name }).first().waitFor();
  await close();
  await program.stop();
});
