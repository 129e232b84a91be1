// Runs that go on beside a project that is edited.
import { writeFileSync } from "node:fs";
import { join } from "node:path";

import { text, until } from "./browser.mjs";
import { copy_of, node, open_design, serve_design, settled } from "./design.mjs";

/** The page of a copy of an example, with its tree and the shadow run of a scenario; `texts` are written into the copy. */
export async function open_beside(example, scenario, texts = {}) {
  const folder = copy_of(example);
  for (const [file, content] of Object.entries(texts)) writeFileSync(join(folder, file), content);
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await page.getByTestId("design-tree").waitFor();
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption(scenario);
  await settled(page);
  return { folder, program, page, close };
}

export async function begin_run(page, how) {
  await page.getByRole("button", { name: "Record a run of the scenario" }).click();
  await page.getByRole("menuitem", { name: how }).click();
}

/** The file that the run is recorded into. */
export const records = async (page) => (await page.getByTestId("records").getAttribute("title")).replace("runs/", "");

export async function stop_run(page) {
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Stop" }).click();
  await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
  await page.getByTestId("records").waitFor({ state: "detached" });
}

/** A node of the tree gets another name, by keyboard. */
export async function rename_node(page, from, to) {
  await page.getByRole("button", { name: "Design", exact: true }).click();
  await node(page, from).click();
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("F2");
  await page.keyboard.press("Control+a");
  await page.keyboard.type(to);
  await page.keyboard.press("Enter");
  await node(page, to).waitFor();
  await settled(page);
}
