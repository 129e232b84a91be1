// A chart and a tree are run by hand, alone; the way back is open, and edits are followed.
import assert from "node:assert/strict";
import { mkdirSync, openSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { copy_of, open_design, serve_design, settled } from "../harness/design.mjs";
import { run, scratch } from "../harness/program.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

const active = (page) => page.locator("[data-testid=design-chart] [data-active=true]").evaluateAll((states) => states.map(({ dataset }) => dataset.id).filter(Boolean));
const in_states = (page, states) => until(async () => (await active(page)).join() === states.join(), `in ${states}`);
const said = (page, node) => page.locator(`[data-played="${node}"]`).getAttribute("data-said");
const is_said = (page, node, status) => until(async () => (await said(page, node)) === status, `${node} says ${status}`);

test("a chart alone: an event with a form from the interface, back, an edit, and the steps as a file", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "skills/BatteryLevelAbove.scxml" });
  await settled(page);
  await page.getByTestId("simulate-button").click();
  await in_states(page, ["asking"]);
  await page.getByTestId("simulate-trace").getByText("getBatteryState").waitFor();
  // What a leaf would give it.
  const threshold = page.getByRole("textbox", { name: "threshold" });
  await threshold.fill("30");
  await threshold.press("Enter");
  await page.locator('[data-event="battery.getBatteryState.reply"]').click();
  const percentage = page.getByRole("textbox", { name: /percentage$/ });
  await percentage.fill("0.5");
  if (pictures) await page.screenshot({ path: join(pictures, "simulate-chart.png") });
  await page.getByRole("form", { name: "Event" }).getByRole("button", { name: "Send" }).click();
  await in_states(page, ["success"]);
  await page.getByTestId("simulate-now").and(page.locator('[data-status="finished"]')).waitFor();
  const saving = page.waitForEvent("download");
  await page.getByRole("button", { name: "Save the steps" }).click();
  const steps = join(scratch(), "steps");
  await (await saving).saveAs(steps);
  const again = await run(["chart", join(folder, "skills/BatteryLevelAbove.scxml"), "--data", "threshold=30"], { stdio: [openSync(steps), "pipe", "pipe"] });
  assert.match(again.stdout, /enter success/);
  await page.getByRole("button", { name: /^Back/ }).click();
  await in_states(page, ["asking"]);
  // A label in the picture is a button, too.
  await page.locator('[data-testid=design-chart] [data-enabled=true]', { hasText: "error" }).last().click();
  await in_states(page, ["failure"]);
  // What was done is done again with another text.
  const file = join(folder, "skills/BatteryLevelAbove.scxml");
  writeFileSync(file, readFileSync(file, "utf8").replace('event="battery.getBatteryState.error error" target="failure"', 'event="battery.getBatteryState.error error" target="success"'));
  await in_states(page, ["success"]);
  // What becomes active comes into view.
  const in_view = () =>
    page.locator('[data-testid=design-chart] [data-id="asking"]').evaluate((state) => {
      const [inner, outer] = [state.getBoundingClientRect(), state.closest("svg").getBoundingClientRect()];
      return inner.left >= outer.left - 1 && inner.right <= outer.right + 1 && inner.top >= outer.top - 1 && inner.bottom <= outer.bottom + 1;
    });
  const picture = await page.getByTestId("design-chart").boundingBox();
  await page.mouse.move(picture.x + 4, picture.y + picture.height - 4);
  for (let i = 0; i < 20 && (await in_view()); i += 1) await page.mouse.wheel(0, -100);
  assert.equal(await in_view(), false);
  await page.getByRole("button", { name: "Begin again" }).click();
  await in_states(page, ["asking"]);
  await until(in_view, "the state is in view");
  await close();
  await program.stop();
});

test("a tree alone: leaves answer as one clicks, each click is a tick, and back takes them back", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "mission.xml" });
  await settled(page);
  await page.getByTestId("simulate-button").click();
  await is_said(page, "BatteryLevelAbove30", "FAILURE");
  await is_said(page, "GoToStation", "RUNNING");
  for (const [width, height] of [[1366, 768], [1440, 900]]) {
    await page.setViewportSize({ width, height });
    const { over, outside } = await page.getByTestId("design-tree").evaluate((tree) => {
      const box = (element) => element.getBoundingClientRect();
      const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
      const answers = [...tree.querySelectorAll(".played-answer circle")].map(box);
      const texts = [...tree.querySelectorAll(".node > text")].filter((text) => getComputedStyle(text).display !== "none");
      const room = box(tree);
      return { over: texts.filter((text) => answers.some((answer) => meet(answer, box(text)))).map(({ textContent }) => textContent), outside: answers.filter(({ bottom }) => bottom > room.bottom).length };
    });
    assert.deepEqual([over, outside], [[], 0], `answers at ${width}×${height}`);
  }
  await page.locator('[data-played="BatteryLevelAbove30"] [data-answer="SUCCESS"]').click();
  await is_said(page, "BatteryLevelAbove30", "SUCCESS");
  await page.locator('[data-leaf$="BatteryNotRecharging"]').getByRole("button", { name: "success" }).click();
  await is_said(page, "NoNeed", "SUCCESS");
  await is_said(page, "GoToStation", "IDLE");
  await is_said(page, "GoToKitchen", "RUNNING");
  if (pictures) await page.screenshot({ path: join(pictures, "simulate-tree.png") });
  await page.locator('[data-played="GoToKitchen"] [data-answer="SUCCESS"]').click();
  await page.getByTestId("simulate-now").and(page.locator('[data-status="SUCCESS"]')).waitFor();
  await page.getByRole("button", { name: /^Back/ }).click();
  await is_said(page, "GoToKitchen", "RUNNING");
  // An edit is followed, with the answers as they were given.
  writeFileSync(join(folder, "mission.xml"), readFileSync(join(folder, "mission.xml"), "utf8").replace('<AtLocation name="AtKitchen" location="kitchen"/>\n', ""));
  await until(async () => (await page.locator('[data-played="AtKitchen"]').count()) === 0, "the node is gone");
  await is_said(page, "GoToKitchen", "RUNNING");
  await is_said(page, "BatteryLevelAbove30", "SUCCESS");
  await page.getByRole("button", { name: "End", exact: true }).click();
  await until(async () => (await page.locator("[data-played]").count()) === 0, "it is over");
  await close();
  await program.stop();
});
