// With motion, which the other cases turn off: pictures end where they belong, whatever size their panel got meanwhile.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, until } from "../harness/browser.mjs";
import { copy_of } from "../harness/design.mjs";
import { run, serve } from "../harness/program.mjs";

/** Of what the panel could hold; around a chart there is a margin. */
const kSeenMin = 0.85;

/** How much of the chart lies in its panel, of what the panel could hold; and where the chart is. */
const lie_of = (page) =>
  page.evaluate(() => {
    const svg = document.querySelector("#panel-charts svg.chart-picture");
    const [frame, drawn] = [svg.getBoundingClientRect(), svg.querySelector("g").getBoundingClientRect()];
    const shared = (from, to, start, end) => Math.max(0, Math.min(to, end) - Math.max(from, start));
    const seen = shared(drawn.left, drawn.right, frame.left, frame.right) * shared(drawn.top, drawn.bottom, frame.top, frame.bottom);
    const most = Math.min(drawn.width, frame.width) * Math.min(drawn.height, frame.height);
    return { seen: most > 0 ? seen / most : 0, moves: document.querySelector("#panel-charts svg.chart-picture > g").getAttribute("transform") };
  });

/** It stands still: the same in ten frames, one after the other. */
const at_rest = (page) =>
  until(async () => {
    const before = await lie_of(page);
    await page.evaluate(async () => {
      for (let i = 0; i < 10; i += 1) await new Promise((next) => requestAnimationFrame(next));
    });
    const after = await lie_of(page);
    return before.moves === after.moves ? after : null;
  }, "the chart stands still");

test("the chart of a counterexample lies in its panel from the first view on, and stays there", async () => {
  const folder = copy_of("modelled");
  assert.equal((await run(["verify", folder])).code, 1);
  const program = await serve(["studio", join(folder, "verify", "asks_again.mcap")]);
  for (const [width, height] of [[1440, 900], [1366, 768]]) {
    const { page, close } = await open_page(program.url, { width, height, motion: "no-preference" });
    await page.getByTestId("chart").locator("[data-state]").first().waitFor();
    assert.ok((await at_rest(page)).seen > kSeenMin, `at ${width} × ${height} it lies in its panel`);
    // Another chart, and another size while it glides.
    const charts = await page.getByTestId("chart-pick").locator("option").evaluateAll((all) => all.map((one) => one.value));
    for (const chart of charts) {
      await page.getByTestId("chart-pick").selectOption(chart);
      await page.setViewportSize({ width: width - 200, height: height - 60 });
      assert.ok((await at_rest(page)).seen > kSeenMin, `${chart} lies in a smaller panel`);
      await page.setViewportSize({ width, height });
      assert.ok((await at_rest(page)).seen > kSeenMin, `${chart} lies in its panel again`);
    }
    await close();
  }
  await program.stop();
});
