// What models chose in a run, and the run once more with another alternative.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { first_message, open_page, operate, text, until } from "../harness/browser.mjs";
import { copy_of } from "../harness/design.mjs";
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

test("what a choice could have been is on offer, and what it has not is refused with the list", async () => {
  const folder = copy_of("modelled");
  const hall = join(folder, "models", "hall.scxml");
  const as_it_is = readFileSync(hall, "utf8");
  const brightness = (page) => page.locator("[data-choice]").filter({ hasText: "between" }).first();
  const opened = async (page) => {
    await page.getByRole("button", { name: "Run again" }).click();
    await page.getByRole("menuitem", { name: /What if a model/ }).click();
    await brightness(page).waitFor();
    return brightness(page).getAttribute("data-choice");
  };
  const run_of = async (step) => {
    writeFileSync(hall, as_it_is.replace("between(60, 100, 10)", `between(60, 100, ${step})`));
    const program = await serve_run(folder, { scenario: "goes-in", args: ["--clock", "virtual", "--factor", "1000"] });
    const { page, close } = await open_page(program.url, { lost_connections: true });
    await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
    return { program, page, close };
  };

  // Few stand there, none can be typed; nor does the program take others.
  const few = await run_of(10);
  const choice = await opened(few.page);
  const chosen_first = await brightness(few.page).getAttribute("data-value");
  const others = ["60", "70", "80", "90", "100"].filter((value) => value !== chosen_first);
  assert.deepEqual(await brightness(few.page).getByRole("button").allInnerTexts(), others.map((value) => `${value} instead`));
  assert.equal(await brightness(few.page).getByRole("textbox").count(), 0);
  const { messages } = await operate(few.page, "messages", { limit: 500, filter: { name: "hall.choice" } });
  const number = Number(choice.split("#")[1]);
  const before = messages.slice(0, number - 1).map(({ data }, i) => `hall#${i + 1}=${JSON.stringify(data.value)}`);
  await assert.rejects(operate(few.page, "run_again", { choose: [...before, `${choice}=65`] }), /has no alternative 65; there are 60, 70, 80, 90, 100/);
  await few.close();
  await few.program.stop();

  // Of many one can be typed; the page says which there are, where it is none.
  const many = await run_of(0.1);
  const { page } = many;
  const { boot } = await first_message(page, "hello");
  await opened(page);
  const field = () => brightness(page).getByRole("textbox");
  assert.match(await field().getAttribute("placeholder"), /^60 … 100, 401 in all/);
  for (const typed of ["abc", "65.05"]) {
    await field().fill(typed);
    await field().press("Enter");
    await until(async () => (await brightness(page).getByRole("alert").allInnerTexts()).some((said) => said.includes(typed)), `${typed} is refused`);
    assert.match(await brightness(page).getByRole("alert").innerText(), /there are 60, .*401 in all/);
    assert.equal(await field().inputValue(), typed);
  }
  assert.equal((await first_message(page, "hello")).boot, boot);
  await field().fill("65");
  await field().press("Enter");
  await until(async () => (await first_message(page, "hello").catch(() => null))?.boot !== boot, "another run began");
  await until(async () => {
    const again = await operate(page, "messages", { limit: 500, filter: { name: "hall.choice" } }).catch(() => null);
    return again?.messages.find(({ data }) => data.function === "between")?.data.value === 65;
  }, "it has what was typed");
  await many.close();
  await many.program.stop();
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
