// Signals over time, what became of a node, panels where one wants them, and an address that says what one looks at.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";

import { open_page, operate, shown_time, text, until } from "../harness/browser.mjs";
import { example, run, scratch, serve } from "../harness/program.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });
const recording = join(scratch(), "run.mcap");
before(async () => assert.equal((await run(["run", example("recharge"), "--scenario", "experiment1", "--clock", "virtual", "--record", recording])).code, 1));
const serve_recording = () => serve(["studio", recording, "--at", "127.0.0.1:0"]);

const kCharge = "robots/robot/battery/percentage";
const kAnswered = "messages/battery.getBatteryState.reply/result/percentage";
const points = async (page) => (await page.getByTestId("plot").getAttribute("data-points")).split(" ").map(Number);
const value = (page, signal) => page.locator(`[data-signal="${signal}"] [data-testid=plot-value]`).innerText().then(Number);

async function place(page, panel, where) {
  await page.getByRole("button", { name: "Panels and arrangements" }).click();
  const items = page.getByRole("menuitemcheckbox", { name: where, exact: true });
  await items.nth(["Monitors", "Messages", "Reached", "Plot"].indexOf(panel)).click();
}

async function plot(page, signal) {
  await page.getByRole("combobox", { name: "Signal to plot" }).fill(signal);
  await page.keyboard.press("Enter");
  await page.locator(`[data-signal="${signal}"]`).waitFor();
}

test("a monitor's data and what it got last are shown and plotted; signals of very different size have an axis each", async () => {
  const program = await serve_recording();
  const { page, close } = await open_page(program.url);
  await page.getByRole("button", { name: "Chart of turns_to_station" }).click();
  const side = page.getByRole("complementary", { name: "Values of turns_to_station" });
  await side.getByRole("heading", { name: "Last event" }).waitFor();
  assert.match(await side.locator("h3:has-text('Last event') + p").innerText(), /^(\w+\.|time passed)/);
  assert.ok((await side.locator(".value-row").count()) > 0, "it has data");
  await place(page, "Plot", "beside the timeline");
  await page.getByRole("combobox", { name: "Signal to plot" }).focus();
  const offered = page.locator('#plot-signals option[value^="charts/monitor:turns_to_station/data/"]').first();
  await offered.waitFor({ state: "attached" });
  const level = await offered.getAttribute("value");
  await plot(page, level);
  await until(async () => (await points(page))[0] > 10, "it has values");
  assert.ok(Number.isFinite(await value(page, level)));
  await page.getByRole("button", { name: `Take ${level} away` }).click();

  await plot(page, "messages/mission.tick/tick");
  await plot(page, kCharge);
  await until(async () => (await points(page)).length === 2 && (await points(page)).every((count) => count > 100), "both have values");
  const axis_of = (signal) => page.locator(`[data-signal="${signal}"]`).getByText(/axis$/).innerText();
  assert.deepEqual([await axis_of("messages/mission.tick/tick"), await axis_of(kCharge)], ["left axis", "right axis"]);
  if (pictures) await page.screenshot({ path: join(pictures, "two-axes.png") });
  await close();
  await program.stop();
});

test("signals are plotted over the timeline's piece of time, with the value under the cursor", async () => {
  const program = await serve_recording();
  const { page, close } = await open_page(program.url);
  await place(page, "Plot", "beside the timeline");
  // Also what was said once, long ago, and the data of charts that are over are offered.
  await page.getByRole("combobox", { name: "Signal to plot" }).focus();
  for (const offered of ["messages/navigation.gotoTargetByLocationName.reply/result/goal_id", "charts/skill:GoToKitchen/data/goal"])
    await page.locator(`#plot-signals option[value="${offered}"]`).waitFor({ state: "attached" });
  await plot(page, "messages/nobody.says.this/number");
  await until(async () => (await page.locator('[data-signal="messages/nobody.says.this/number"] [data-testid=plot-value]').innerText()) === "no number here", "it is said that nothing is there");
  await page.getByRole("button", { name: "Take messages/nobody.says.this/number away" }).click();
  await plot(page, kCharge);
  await plot(page, kAnswered);
  await until(async () => (await points(page)).every((count) => count > 100), "both have values");
  // A scenario that says 10 % at 20 s is seen in both.
  await operate(page, "seek", { time: 0 });
  const of = async (path, from, to) => (await operate(page, "signal", { path: path.split("/"), from, to, width: 1000 })).points;
  const [before_it, after_it] = [(await of(kAnswered, 0, 19.9e9)).at(-1)[1], (await of(kAnswered, 20.1e9, 21e9))[0][1]];
  assert.ok(before_it > 0.9 && after_it <= 0.1, `${before_it} and ${after_it}`);
  const sampled = await of(kCharge, 19e9, 21e9);
  assert.ok(sampled.some(([, charge]) => charge > 0.9) && sampled.some(([, charge]) => charge <= 0.1));
  // Every value is one that was observed: the messages say the same.
  const { messages } = await operate(page, "messages", { filter: { name: "battery.getBatteryState.reply" }, until: 3e9, limit: 500 });
  assert.deepEqual((await of(kAnswered, 0, 3e9)).map(([time]) => time).every((time) => messages.some((one) => one.time === time)), true);

  // Under the cursor: left of the fall it is high, right of it low.
  const box = await page.locator(".plot .u-over").boundingBox();
  await page.mouse.move(box.x + box.width * 0.1, box.y + box.height / 2);
  await until(async () => (await value(page, kAnswered)) > 0.9, "high before it fell");
  await page.mouse.move(box.x + box.width * 0.2, box.y + box.height / 2);
  await until(async () => (await value(page, kAnswered)) < 0.2, "low after it");
  // A click goes to the moment.
  await page.mouse.click(box.x + box.width * 0.2, box.y + box.height / 2);
  await until(async () => Math.abs((await shown_time(page)) - 0.2 * 1.06 * 120e9) < 6e9, "the click goes there");
  if (pictures) await page.screenshot({ path: join(pictures, "plot-1440.png") });

  // What is dragged over is what timeline and plot show.
  const ticks = () => page.locator(".u-axis").first().evaluate((axis) => axis.parentElement.querySelector("canvas").toDataURL().length);
  const wide = await ticks();
  const dense = await points(page);
  await page.mouse.move(box.x + box.width * 0.15, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.25, box.y + box.height / 2, { steps: 4 });
  await page.mouse.up();
  await until(async () => (await points(page))[1] !== dense[1], "fewer messages lie there");
  assert.notEqual(await ticks(), wide);
  await page.mouse.dblclick(box.x + box.width * 0.5, box.y + box.height / 2);
  await until(async () => (await points(page))[1] === dense[1], "all of the time is shown again");
  // The signals stay.
  await page.reload();
  await page.locator(`[data-signal="${kAnswered}"]`).waitFor();
  await page.getByRole("button", { name: `Take ${kCharge} away` }).click();
  assert.equal(await page.locator("[data-signal]").count(), 1);
  await close();
  await program.stop();
});

test("a node's transitions are a table that is saved, and each leads to its moment", async () => {
  const program = await serve_recording();
  const { page, close } = await open_page(program.url);
  await page.locator('[data-testid=tree] [aria-label^="GoToStation"]').click();
  await page.keyboard.press("p");
  const rows = page.locator(".transitions tr");
  await rows.first().waitFor();
  const shown = await rows.allInnerTexts();
  assert.match(shown.join("|"), /0:20\.000\s+RUNNING/);
  await rows.filter({ hasText: "RUNNING" }).first().getByRole("button").click();
  await until(async () => (await shown_time(page)) === 20e9, "it leads to its moment");
  const [file] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save as CSV" }).click()]);
  const lines = readFileSync(await file.path(), "utf8").trim().split("\n");
  assert.equal(lines[0], "time_s,status,duration_s");
  assert.equal(lines.length, shown.length + 1);
  assert.ok(lines.some((line) => line.startsWith("20,RUNNING,")), lines.join("\n"));
  // Of a condition the table has what it answered otherwise than before; so has the file.
  await page.locator('[data-testid=tree] [aria-label^="BatteryLevelAbove30"]').dispatchEvent("click");
  await page.locator(".transitions h3", { hasText: "Answers that changed" }).waitFor();
  const answers = await rows.allInnerTexts();
  const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save as CSV" }).click()]);
  const table = answers.map((row) => /(SUCCESS|FAILURE|RUNNING)/.exec(row)[1]);
  assert.deepEqual(readFileSync(await saved.path(), "utf8").trim().split("\n").slice(1).map((line) => line.split(",")[1]), table);
  await close();
  await program.stop();
});

test("panels stand where one puts them, and an arrangement is found again by its name", async () => {
  const program = await serve_recording();
  const { page, close } = await open_page(program.url);
  await place(page, "Messages", "beside the timeline");
  await page.locator(".below-panels #panel-messages").waitFor();
  await place(page, "Plot", "beside the timeline");
  await page.locator(".below-panels #panel-plot").waitFor();
  // Both are tabs there.
  await page.locator(".below-panels").getByRole("tab", { name: "Messages" }).first().click();
  await page.locator(".below-panels #panel-messages").waitFor();
  await place(page, "Reached", "closed");
  assert.equal(await page.locator("#panel-reached").count(), 0);
  await page.getByRole("button", { name: "Panels and arrangements" }).click();
  await page.getByRole("menuitem", { name: "Save this one as …" }).click();
  await page.getByRole("textbox", { name: "Name of the arrangement" }).fill("mine");
  await page.keyboard.press("Enter");
  if (pictures) await page.screenshot({ path: join(pictures, "panels-1440.png") });
  await page.getByRole("button", { name: "Panels and arrangements" }).click();
  await page.getByRole("menuitem", { name: "As it was at first" }).click();
  await page.locator(".side #panel-messages").waitFor({ state: "attached" });
  await page.reload();
  await page.getByRole("button", { name: "Panels and arrangements" }).click();
  await page.getByRole("menuitem", { name: "mine", exact: true }).click();
  await page.locator(".below-panels #panel-messages").waitFor();
  assert.equal(await page.locator("#panel-reached").count(), 0);
  await close();
  await program.stop();
});

test("the address says moment and selection, and leads another page there", async () => {
  const program = await serve_recording();
  const first = await open_page(program.url);
  await first.page.getByTestId("violation-moment").click();
  await until(async () => (await shown_time(first.page)) === 20e9, "the moment is on show");
  await first.page.locator('[data-testid=tree] [aria-label^="GoToKitchen"]').click();
  const address = await until(() => (/at=20&node=.*GoToKitchen/.test(first.page.url()) ? first.page.url() : null), "the address says both");
  const chart = await first.page.getByTestId("chart-pick").inputValue();
  assert.equal(chart, "skill:GoToKitchen");
  await first.close();
  const second = await open_page(address);
  await until(async () => (await shown_time(second.page)) === 20e9, "another page shows the moment");
  assert.match(await second.page.locator("[data-testid=tree] [aria-selected=true]").getAttribute("aria-label"), /^GoToKitchen/);
  assert.equal(await second.page.getByTestId("chart-pick").inputValue(), chart, "not that of the leaf that was at work");
  // It stays so when the page is loaded anew, and nothing is said of the end.
  await second.page.reload();
  await until(async () => (await shown_time(second.page)) === 20e9, "and so after it is loaded anew");
  await second.page.evaluate(() => (location.hash = "at=53.1"));
  await until(async () => (await shown_time(second.page)) === 53.1e9, "what is written into the address is shown");
  assert.ok((await text(second.page, "clock")).startsWith("0:53.100"));
  await second.close();
  await program.stop();
});
