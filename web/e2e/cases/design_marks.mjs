// What is wrong is marked in pictures, and leads to where it is.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { state_at } from "../harness/chart.mjs";
import { design_of_recharge } from "../harness/design.mjs";

const open = (page, file) => page.locator(`.file-row[data-file="${file}"]`).click();

test("what is doubtful in a chart is marked in its picture, and said at the chosen part", async () => {
  const { page, close, program } = await design_of_recharge();
  await open(page, "skills/GoToLocation.scxml");
  await page.getByTestId("design-chart").waitFor();
  await page.locator("#design-new-state").fill("alone");
  await page.keyboard.press("Enter");
  await page.locator('[data-testid=design-chart] [data-id="alone"].doubtful').waitFor();
  await state_at(page, "alone").click();
  await page.getByTestId("chart-form").locator(".inspector-finding.warning").waitFor();
  await close();
  await program.stop();
});

test("a picture of a text that cannot be read leads to where it is broken", async () => {
  const { page, close, program, folder } = await design_of_recharge();
  await page.getByRole("button", { name: "Picture", exact: true }).click();
  const file = join(folder, "mission.xml");
  writeFileSync(file, readFileSync(file, "utf8").replace('<ReactiveSequence name="Recharge">', '<ReactiveSequence name="Recharge"'));
  await page.getByTestId("broken").getByRole("button", { name: "Go there" }).click();
  await until(() => page.evaluate(() => document.activeElement?.closest(".cm-editor") !== null), "the text has the focus");
  await page.locator(".cm-activeLine", { hasText: /Recharge|BeAtStation/ }).waitFor();
  await close();
  await program.stop();
});

test("a file that nothing names says so, and what is wrong with it", async () => {
  const { page, close, program, folder } = await design_of_recharge((copy) => {
    writeFileSync(join(copy, "requirements", "idle.req"), "idle: always level >= .\n");
    writeFileSync(join(copy, "skills", "Unused.scxml"), "<scxml><state></scxml>");
    writeFileSync(join(copy, "compose.yaml"), "services: [\n");
  });
  const badge = (file) => page.locator(`.file-row[data-file="${file}"] .file-badge.warning`);
  await badge("requirements/idle.req").waitFor();
  await badge("skills/Unused.scxml").waitFor();
  await open(page, "requirements/idle.req");
  await page.getByTestId("problems").click();
  const rows = page.getByRole("list", { name: "Problems" }).getByRole("listitem");
  await rows.filter({ hasText: "requirements/idle.req is watched by nobody; name it under monitors" }).waitFor();
  await rows.filter({ hasText: /idle\.req:1/ }).first().waitFor();
  // What is none of the project's is told of while it is open.
  assert.equal(await rows.filter({ hasText: "compose.yaml" }).count(), 0);
  await open(page, "compose.yaml");
  await rows.filter({ hasText: /compose\.yaml:\d/ }).waitFor();
  await open(page, "mission.xml");
  await until(async () => (await rows.filter({ hasText: "compose.yaml" }).count()) === 0, "it is of others again");
  // Mended, and named: nothing is left to tell.
  writeFileSync(join(folder, "requirements", "idle.req"), "# nothing yet\n");
  writeFileSync(join(folder, "skills", "Unused.scxml"), readFileSync(join(folder, "skills", "GoToLocation.scxml")));
  await until(async () => (await badge("skills/Unused.scxml").count()) === 0, "the chart is whole");
  await until(async () => (await rows.filter({ hasText: /idle\.req:1/ }).count()) === 0, "the requirements are whole");
  await close();
  await program.stop();
});
