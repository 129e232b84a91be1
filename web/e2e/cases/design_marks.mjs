// What is wrong is marked in pictures, and leads to where it is.
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
