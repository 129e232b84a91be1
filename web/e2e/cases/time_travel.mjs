// Rewind shows the earlier state, in every panel; the way back is one key.
import assert from "node:assert/strict";
import { test } from "node:test";

import { open_page, operate, shown_time, text, until, verdicts } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

async function ended_run(scenario) {
  const program = await serve_run(example("recharge"), { scenario, args: ["--clock", "virtual", "--factor", "1000"] });
  const opened = await open_page(program.url);
  await until(async () => (await text(opened.page, "presence")) === "■ Ended", "the run has ended");
  return { program, ...opened };
}

test("the timeline goes to any moment, and back", async () => {
  const { program, page, close } = await ended_run("experiment1");
  const end = await shown_time(page);
  await page.locator("#panel-timeline [role=slider]").focus();
  await page.keyboard.press("Home");
  await until(async () => (await shown_time(page)) === 0, "Home shows the beginning");
  assert.match(await text(page, "past-strip"), /You look at the past/);
  assert.equal((await verdicts(page)).battery, "undecided");
  for (let i = 0; i < 3; i++) await page.keyboard.press("Shift+ArrowRight");
  await until(async () => (await shown_time(page)) > 0, "the arrow moves on");
  await page.keyboard.press("l");
  await until(async () => (await shown_time(page)) === end, "L shows the end again");
  assert.equal((await verdicts(page)).battery, "violated");
  await close();
  await program.stop();
});

test("the replay plays on by itself, and stops at the end", async () => {
  const { program, page, close } = await ended_run("experiment1");
  const end = await shown_time(page);
  await page.getByTestId("replay").click();
  await until(async () => (await shown_time(page)) < end, "it begins at the beginning");
  const first = await shown_time(page);
  await until(async () => (await shown_time(page)) > first, "it plays");
  await page.getByLabel("Speed of the replay").selectOption("16");
  await until(async () => (await page.getByTestId("replay").getAttribute("aria-pressed")) === "false", "it stops at the end");
  await until(async () => (await shown_time(page)) === end, "the end is shown");
  await close();
  await program.stop();
});

test("a click on a message goes to its moment; search finds it", async () => {
  const { program, page, close } = await ended_run("experiment1");
  await page.keyboard.press("m");
  await page.locator("#panel-messages .message").first().waitFor();
  await page.getByLabel("Text").fill("setBatteryCharge");
  await page.getByRole("button", { name: "Look further back" }).click();
  const row = page.locator("#panel-messages .message.notable");
  await row.first().click();
  await until(async () => (await shown_time(page)) === 20e9, "the injection was at 20 s");
  assert.match(await page.locator(".message-open").innerText(), /setBatteryCharge/);
  // What the program itself says about that moment.
  const { messages } = await operate(page, "messages", { until: 20e9, limit: 500, filter: { name: "scenario.injection" } });
  assert.equal(messages.at(-1).time, 20e9);
  await close();
  await program.stop();
});

test("a long witness can be read to its end", async () => {
  const { program, page, close } = await ended_run("experiment2");
  await page.keyboard.press("v");
  const details = await page.getByTestId("violation-story").evaluate((all) => [all, ...all.children].map((element) => element.clientHeight));
  assert.ok(Math.max(...details) === details[0], "story and witness stay within their frame");
  await page.locator(".witness-line").last().click();
  await until(async () => (await shown_time(page)) === 53.1e9, "its last observation was at 53.1 s");
  await close();
  await program.stop();
});

test("several pages are each at a moment of their own", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const pages = await Promise.all([1, 2, 3].map(() => open_page(program.url)));
  const [first, second, third] = pages.map((opened) => opened.page);
  await until(async () => (await shown_time(first)) > 1e9, "a second has passed");
  await first.locator("#panel-timeline [role=slider]").press("Home");
  await until(async () => (await shown_time(first)) === 0, "the first is at the beginning");
  const then = await shown_time(second);
  await until(async () => (await shown_time(second)) > then && (await shown_time(third)) > then, "the others follow the run");
  const newest = () => first.locator("#panel-timeline .readout").innerText();
  const known = await newest();
  await until(async () => (await newest()) !== known, "how far the run has come is shown beside the past too");
  assert.equal(await shown_time(first), 0);
  assert.equal(await text(second, "presence"), "● Live");
  // What one does all see.
  await third.getByTestId("pause").click();
  await until(async () => /Paused/.test(await text(second, "presence")), "a pause is seen by all");
  for (const opened of pages) await opened.close();
  await program.stop();
});
