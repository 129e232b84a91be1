// What an edit means is seen before it is saved: the scenario runs again, and the page stays at its moment.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { copy_of, node, open_design, select_word, serve_design, settled } from "../harness/design.mjs";
import { run, scratch } from "../harness/program.mjs";

/** What the timeline shows of a lane near the newest moment. */
async function lane_says(page, lane) {
  const row = await page.locator(`#panel-timeline [data-lane="${lane}"]`).boundingBox();
  const lanes = await page.locator(".timeline-lanes").boundingBox();
  await page.mouse.move(lanes.x + lanes.width / 2, row.y + row.height / 2);
  await page.mouse.move(lanes.x + lanes.width * 0.93, row.y + row.height / 2);
  return page.locator(".timeline-tip").innerText();
}

const verdict = (page, monitor) => page.locator(`[data-monitor-chip="${monitor}"]`).getAttribute("data-verdict");

for (const [width, height] of [[1440, 900], [1366, 768], [1024, 700]]) test(`a mended skill takes the violation away, at the same moment; undo brings it back, at ${width}×${height}`, async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { width, height });
  await page.getByTestId("design-tree").waitFor();
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption("experiment2");
  await settled(page);
  // The page looks at 53.1 s.
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator("h1", { hasText: "experiment2" }).waitFor();
  await page.getByTestId("violation-moment").click();
  await page.getByTestId("past-strip").waitFor();
  await page.getByRole("button", { name: "Design", exact: true }).click();
  await until(async () => (await page.getByTestId("design-clock").innerText()).includes("53.1"), "the moment is on show");
  assert.equal(await verdict(page, "recharge"), "violated");

  await page.locator('[data-file="skills/BatteryLevelAbove-buggy.scxml"]').click();
  await select_word(page, "Math.min(threshold, 20)", "20");
  const began = Date.now();
  await page.keyboard.type("100");
  await until(async () => (await verdict(page, "recharge")) === "undecided", "the verdict is another one");
  console.log(`# edit to verdict: ${Date.now() - began} ms`);
  assert.match(await page.getByTestId("design-clock").innerText(), /53\.1/);
  assert.match(await page.getByTestId("difference").innerText(), /First difference 52\.0 s/);
  // All of it is to be seen: when, what, the mission and the monitors.
  const cut = await page.getByTestId("shadow").evaluate((strip) => {
    const inside = (inner, outer) => inner.getBoundingClientRect().width > 0 && inner.getBoundingClientRect().right <= outer.getBoundingClientRect().right;
    const when = strip.querySelector("[data-testid=difference] strong");
    const chips = [...strip.querySelectorAll(".verdict-chips .badge, [data-testid=timeline-switch]")];
    return [...(inside(when, when.closest("button")) ? [] : ["when"]), ...chips.filter((chip) => !inside(chip, strip) || chip.scrollWidth > chip.clientWidth).map(({ textContent }) => textContent)];
  });
  assert.deepEqual(cut, []);
  assert.equal(await page.getByTestId("shadow").getByTestId("mission-status").innerText(), "RUNNING");
  const lanes = height > 760;
  if (lanes) await until(async () => /undecided/.test(await lane_says(page, "monitor:recharge")), "the timeline is that of the new run");
  // All of the differences are told.
  await page.getByRole("button", { name: "All differences" }).click();
  assert.ok((await page.getByRole("menuitem").count()) > 1);
  await page.keyboard.press("Escape");
  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+z");
  await until(async () => (await verdict(page, "recharge")) === "violated", "undo brings it back");
  assert.match(await page.getByTestId("design-clock").innerText(), /53\.1/);
  await until(async () => (await page.getByTestId("difference").count()) === 0, "and there is no difference");
  if (lanes) await until(async () => /violated/.test(await lane_says(page, "monitor:recharge")), "the timeline is that of the run before");

  // From another moment its verdict leads back.
  await page.keyboard.press("Control+Shift+Z");
  await page.getByTestId("difference").click();
  await until(async () => (await page.getByTestId("design-clock").innerText()).includes("52.0"), "the first difference is on show");
  await page.keyboard.press("Control+z");
  await until(async () => (await page.getByTestId("difference").count()) === 0, "it is undone");
  await page.locator('[data-monitor-chip="recharge"]').getByRole("button").click();
  await until(async () => (await page.getByTestId("design-clock").innerText()).includes("53.1"), "the violation is on show");
  await page.getByTestId("happened").getByText("recharge is violated at 0:53.1").waitFor();

  // What does not load is not run.
  await page.locator('[data-file="mission.xml"]').click();
  await node(page, "AtKitchen").waitFor();
  await close();
  await program.stop();
});

test("after a shorter run in between the timeline shows what it showed before", async () => {
  const folder = join(scratch(), "robot");
  assert.equal((await run(["init", folder])).code, 0);
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "BatteryOk").click();
  await settled(page);
  const timeline = page.locator("#panel-timeline [data-view]");
  const view = async () => (await timeline.getAttribute("data-view")).split(" ").map(Number);
  const span = async () => (await view())[1] - (await view())[0];
  const end = await page.getByTestId("design-clock").innerText();
  /** The robot has nothing to do, and then it has. */
  const there_and_back = async () => {
    await page.locator("#design-port-percent").fill("200");
    await page.keyboard.press("Enter");
    await until(async () => (await span()) < 2, "the run is over at once");
    await page.getByTestId("undo").click();
    await until(async () => (await span()) > 2, "it is as long as before");
    await settled(page);
    await until(async () => (await page.getByTestId("design-clock").innerText()) === end, "its end is on show");
  };
  await until(async () => (await view())[0] <= 0 && (await view())[1] > 38, "the whole run");
  await there_and_back();
  await until(async () => (await view())[0] <= 0 && (await view())[1] > 38, "the whole run again");
  // Around the moment on show, the run's end.
  const lanes = await page.locator(".timeline-lanes").boundingBox();
  await page.mouse.move(lanes.x + lanes.width - 4, lanes.y + 10);
  await page.keyboard.down("Control");
  await page.mouse.wheel(0, -400);
  await page.keyboard.up("Control");
  await until(async () => (await span()) < 30, "one has zoomed");
  const before = await view();
  await there_and_back();
  assert.deepEqual(await view(), before);
  await close();
  await program.stop();
});

test("a page that shows the end of the run stays at that moment when an edit lets it end elsewhere", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url, { file: "sentree.yaml" });
  await settled(page);
  const clock = () => page.getByTestId("design-clock").innerText();
  const before = await clock();
  await select_word(page, "mission:", "10");
  await page.keyboard.type("2");
  await page.getByTestId("difference").waitFor();
  // Another moment than the end of this run.
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.getByTestId("past-strip").waitFor();
  await page.getByRole("button", { name: "Design", exact: true }).click();
  assert.equal(await clock(), before);
  // One click leads to where it ends now.
  await page.getByTestId("to-end").click();
  await until(async () => (await clock()) !== before && (await page.getByTestId("mission-status").innerText()) === "SUCCESS", "the end is on show");
  assert.equal(await page.getByTestId("to-end").count(), 0);
  await close();
  await program.stop();
});
