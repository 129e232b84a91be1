// What models chose in a run, and the run once more with another alternative.
import assert from "node:assert/strict";
import { test } from "node:test";

import { first_message, open_page, operate, text, until } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

const chosen = async (page) => (await operate(page, "messages", { limit: 500, filter: { name: "person.choice" } })).messages.map(({ data }) => data.value);

test("a choice is made otherwise: the run is the same up to there", async () => {
  const program = await serve_run(example("handover"), { args: ["--clock", "virtual", "--factor", "1000", "--seed", "4", "--duration", "5 s"] });
  const { page, close } = await open_page(program.url, { lost_connections: true });
  const ended = () => until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
  await ended();
  // Takes another alternative of one choice; what the other run chose.
  const otherwise = async (number) => {
    const before = await chosen(page);
    const { boot } = await first_message(page, "hello");
    await page.getByRole("button", { name: "Run again" }).click();
    await page.getByRole("menuitem", { name: /What if a model/ }).click();
    await page.locator("[data-choice]").first().waitFor();
    assert.deepEqual(await page.locator("[data-choice]").evaluateAll((rows) => rows.map((row) => [row.dataset.choice, row.dataset.value === "true"])), before.map((value, i) => [`person#${i + 1}`, value]));
    await page.locator(`[data-choice="person#${number}"]`).getByRole("button", { name: `${!before[number - 1]} instead` }).click();
    const again = await until(async () => {
      const now = await first_message(page, "hello").catch(() => null);
      return now && now.boot !== boot ? now.boot : null;
    }, "another run began");
    await page.locator(`header[data-boot="${again}"]`).waitFor();
    await ended();
    const after = await chosen(page);
    assert.deepEqual(after.slice(0, number), [...before.slice(0, number - 1), !before[number - 1]]);
    return after;
  };
  if ((await chosen(page))[0]) await otherwise(1);
  // Nobody pulled at first: a second choice came, and is made otherwise.
  const after = await otherwise(2);
  assert.equal(after.length >= 2, true);
  await close();
  await program.stop();
});

test("a run without models says so", async () => {
  const program = await serve_run(example("minimal"), { args: ["--clock", "virtual", "--factor", "1000"] });
  const { page, close } = await open_page(program.url);
  await page.getByRole("button", { name: "Run again" }).click();
  await page.getByRole("menuitem", { name: /What if a model/ }).click();
  await page.getByText("No model has chosen anything").waitFor();
  await page.keyboard.press("Escape");
  await until(async () => (await page.getByRole("dialog").count()) === 0, "it closes");
  await close();
  await program.stop();
});
