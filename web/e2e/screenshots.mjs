// The pictures of the README and of docs/designing.md, from real runs and a project that is edited: node e2e/screenshots.mjs [FOLDER]
import { spawnSync } from "node:child_process";
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, text, until } from "./harness/browser.mjs";
import { copy_of, open_design, serve_design, settled } from "./harness/design.mjs";
import { smaller } from "./harness/png.mjs";
import { example, kRoot, program as sentree, serve_run } from "./harness/program.mjs";

const folder = process.argv[2] ?? join(kRoot, "docs/images");
mkdirSync(folder, { recursive: true });
const keep = async (page, name) => writeFileSync(join(folder, `${name}.png`), smaller(await page.screenshot()));

for (const theme of ["light", "dark"]) {
  test(`studio-${theme}`, async () => {
    const program = await serve_run(example("recharge"), { scenario: "experiment1", args: ["--clock", "virtual", "--factor", "1000"] });
    const { page, close } = await open_page(program.url, { theme, width: 1440, height: 960 });
    await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
    await page.getByTestId("violation-banner").getByRole("button", { name: "never_empty" }).click();
    await page.getByTestId("violation-moment").click();
    await page.getByTestId("past-strip").waitFor();
    await page.keyboard.press("v");
    await page.getByTestId("violation-story").waitFor();
    await page.evaluate(() => new Promise((settle) => requestAnimationFrame(() => requestAnimationFrame(settle))));
    await keep(page, `studio-${theme}`);
    await close();
    await program.stop();
  });
}

// By name of the picture: the file that is open, and what is there when all of it is.
const kDesigns = {
  tree: ["mission.xml", "[data-testid=design-tree]"],
  chart: ["skills/GoToLocation.scxml", "[data-testid=design-chart]"],
  scenario: ["scenarios/experiment1.yaml", "[data-entry='0']"],
  requirement: ["requirements/recharge.req", "[data-past-run]"],
  settings: ["sentree.yaml", "[data-testid=project-form]"],
};

test("design", async () => {
  const folder_of_project = copy_of("recharge");
  const recording = join(folder_of_project, "runs", "experiment1.mcap");
  spawnSync(sentree, ["run", folder_of_project, "--scenario", "experiment1", "--clock", "virtual", "--record", recording]);
  const program = await serve_design(folder_of_project);
  for (const [name, [file, shown]] of Object.entries(kDesigns)) {
    const { page, close } = await open_design(program.url, { width: 1280, height: 800, file });
    await page.locator(shown).first().waitFor();
    await page.locator(".cm-content").waitFor();
    await settled(page);
    if (name === "chart") {
      await page.locator('[data-testid=design-chart] [data-id="starting"] .name').first().click();
      await page.getByTestId("design-chart").press("t");
    }
    if (name === "requirement") {
      const chart = page.locator("details", { hasText: "The chart that watches for it" }).first();
      await chart.locator("summary").click();
      await chart.evaluate((element) => element.scrollIntoView({ block: "end" }));
    }
    await keep(page, `design-${name}`);
    await close();
  }
  await program.stop();
});
