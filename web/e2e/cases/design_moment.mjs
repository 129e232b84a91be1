// What the shadow run says beside what is edited: of the nodes at its moment, of the mission, of what its scenario expects.
import assert from "node:assert/strict";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { design_of_recharge, node, settled } from "../harness/design.mjs";

const opened = (page, file) => page.locator(`.file-row[data-file="${file}"][aria-current=true]`).waitFor();

test("at a moment of the shadow run the edited tree says what its nodes are, and the strip how it ended", async () => {
  const { page, close, program } = await design_of_recharge();
  const status = () => page.getByTestId("shadow").getByTestId("mission-status").innerText();
  const said = page.locator("[data-testid=design-tree] [data-status]");
  await until(async () => (await status()) === "SUCCESS", "the mission ended so");
  assert.equal(await said.count(), 0);
  const time = await page.locator("#panel-timeline").boundingBox();
  await page.mouse.click(time.x + time.width * 0.4, time.y + 10);
  await page.locator('[data-testid=design-tree] [data-name="GoToKitchen"][data-status=RUNNING]').waitFor();
  await until(async () => (await status()) === "RUNNING", "the mission is under way");
  // An edit leaves the moment and what is known of it.
  await node(page, "WaitForUser").click();
  await page.keyboard.press("Delete");
  await node(page, "WaitForUser").waitFor({ state: "detached" });
  await settled(page);
  await page.locator('[data-testid=design-tree] [data-name="GoToKitchen"][data-status=RUNNING]').waitFor();
  await close();
  await program.stop();
});

test("whether the scenario comes out as it expects is said while one edits", async () => {
  const { page, close, program } = await design_of_recharge();
  const expected = page.getByTestId("expected");
  // The mission alone expects nothing.
  assert.equal(await expected.count(), 0);
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption("normal");
  await expected.getByText("✓ as expected").waitFor();
  await node(page, "GoToKitchen").click();
  await page.keyboard.press("Delete");
  await expected.getByText(/✗ \d unexpected/).click();
  await page.getByRole("menuitem", { name: "mission status FAILURE, expected SUCCESS" }).click();
  await opened(page, "scenarios/normal.yaml");
  await page.getByTestId("unmet").getByText("expected SUCCESS").waitFor();
  await close();
  await program.stop();
});
