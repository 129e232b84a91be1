// The pictures of the README, from real runs of the demo: node e2e/screenshots.mjs [FOLDER]
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, text, until } from "./harness/browser.mjs";
import { example, kRoot, serve_run } from "./harness/program.mjs";

const folder = process.argv[2] ?? join(kRoot, "docs/images");
mkdirSync(folder, { recursive: true });

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
    await page.screenshot({ path: join(folder, `studio-${theme}.png`) });
    await close();
    await program.stop();
  });
}
