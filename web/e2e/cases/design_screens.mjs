// Design mode on small screens, and for people who use the keyboard or a screen reader.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { test } from "node:test";

import { copy_of, node, open_design, serve_design, settled } from "../harness/design.mjs";

const kScreens = [[1920, 1080], [1440, 900], [1366, 768], [1024, 700]];
const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

test("the whole tree is visible and readable on every screen, and nothing serious bars the way", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  for (const [width, height] of kScreens) {
    const { page, close } = await open_design(program.url, { width, height });
    await node(page, "BatteryLevelAbove30").click();
    await settled(page);
    if (pictures) await page.screenshot({ path: join(pictures, `design-${width}.png`) });
    const look = () => page.evaluate(() => {
      const frame = document.querySelector("[data-testid=design-tree]").getBoundingClientRect();
      const nodes = [...document.querySelectorAll("[data-testid=design-tree] [data-element]")];
      const inside = ({ left, right, top, bottom }) => left >= frame.left - 1 && right <= frame.right + 1 && top >= frame.top - 1 && bottom <= frame.bottom + 1;
      const sizes = nodes.flatMap((element) =>
        [...element.querySelectorAll("text.name")].map((text) => {
          const { a, b } = text.getScreenCTM();
          return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(a, b);
        }),
      );
      return { inside: nodes.filter((element) => inside(element.querySelector(".shape").getBoundingClientRect())).length, least: Math.min(...sizes) };
    });
    const beside = await look();
    await page.getByRole("button", { name: "Picture", exact: true }).click();
    await page.locator(".code").waitFor({ state: "detached" });
    const alone = await look();
    if (pictures) await page.screenshot({ path: join(pictures, `design-picture-${width}.png`) });
    console.log(`# ${width}×${height}: names of at least ${alone.least.toFixed(1)} px, with the text ${beside.least.toFixed(1)} px`);
    assert.deepEqual([beside.inside, alone.inside], [13, 13], `at ${width}×${height}`);
    assert.ok(alone.least >= 10 && beside.least >= 10, `names at ${width}×${height}`);
    await page.getByRole("button", { name: "Both", exact: true }).click();
    await page.locator(".code").waitFor();
    const require = createRequire(import.meta.url);
    // The page's content policy admits no inline script; the text is evaluated by the driver.
    await page.evaluate(readFileSync(require.resolve("axe-core/axe.min.js"), "utf8"));
    const found = await page.evaluate(async () => (await window.axe.run({ exclude: [[".design-timeline"]] })).violations.map(({ id, impact, nodes }) => ({ id, impact, where: nodes.map(({ target }) => target.join(" ")).slice(0, 3) })));
    const serious = found.filter(({ impact }) => impact === "serious" || impact === "critical");
    assert.deepEqual(serious, [], `axe at ${width}×${height}`);
    await close();
  }
  await program.stop();
});
