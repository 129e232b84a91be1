// What was never reached is listed on the page, entry by entry as `sentree test --coverage` has it; each entry opens what it is about.
import assert from "node:assert/strict";
import { rmSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, until } from "../harness/browser.mjs";
import { copy_of, open_design, serve_design, settled } from "../harness/design.mjs";
import { example, run, scratch, serve, serve_run } from "../harness/program.mjs";

const project = example("recharge");
const kinds = ["nodes", "states", "transitions", "guards", "methods", "requirements"];

async function coverage(folder, ...args) {
  const told = JSON.parse((await run(["test", folder, "--coverage", "--json", ...args])).stdout).coverage;
  return Object.fromEntries(kinds.map((kind) => [kind, `${told[kind].reached} of ${told[kind].of}`]));
}

const counts = (page) => page.locator(".reached-kind").evaluateAll((found) => Object.fromEntries(found.map((kind) => [kind.dataset.kind, kind.querySelector(".number").textContent])));

async function shot(page, name) {
  if (process.env.SENTREE_PICTURES) await page.screenshot({ path: join(process.env.SENTREE_PICTURES, `${name}.png`) });
}

test("of a run and of its recording, with marks in tree and charts", async () => {
  const recording = join(scratch(), "run.mcap");
  await run(["run", project, "--scenario", "normal", "--clock", "virtual", "--record", recording]);
  const expected = await coverage(project, "--scenario", "normal");
  const live = () => serve_run(project, { scenario: "normal", args: ["--clock", "virtual", "--factor", "1000"] });
  const recorded = () => serve(["studio", recording]);
  for (const [name, show] of [["live", live], ["recording", recorded]]) {
    const program = await show();
    const { page, close } = await open_page(program.url);
    await page.getByRole("tab", { name: "Reached" }).click();
    await page.getByTestId("reached").waitFor();
    await until(async () => JSON.stringify(await counts(page)) === JSON.stringify(expected), `${name}: ${JSON.stringify(expected)}`);
    // A node that was never ticked: marked, and chosen by its entry.
    await page.locator(".reached-kind[data-kind=nodes]").click();
    const node = page.locator('[data-testid=tree] [aria-label^="GoToStation"]');
    assert.match(await node.getAttribute("class"), /never-ticked/);
    assert.doesNotMatch(await page.locator('[data-testid=tree] [aria-label^="GoToKitchen"]').getAttribute("class"), /never-ticked/);
    await page.locator('[data-never$="GoToStation"] button').click();
    await until(async () => (await node.getAttribute("aria-selected")) === "true", "the node is chosen");
    // A guard that never was false: its chart, with the transition.
    await page.locator(".reached-kind[data-kind=guards]").click();
    const guard = page.locator(".reached-lines li", { hasText: "percentage * 100 > threshold" }).first();
    assert.match(await guard.innerText(), /never false/);
    await guard.locator("button").click();
    await page.locator("#panel-charts .sought .arrow").first().waitFor();
    await page.locator(".reached-kind[data-kind=states]").click();
    const state = page.locator(".reached-lines li", { hasText: "BatteryLevelAbove.scxml" }).first();
    const id = (await state.locator(".mono").first().innerText()).trim();
    await state.locator("button").click();
    await page.locator(`#panel-charts [data-id="${id}"].never.sought`).waitFor();
    await shot(page, `reached-${name}`);
    // Without the list there are no marks.
    await page.getByRole("tab", { name: "Messages" }).click();
    await until(async () => (await page.locator(".never-ticked, .never").count()) === 0, "the marks are gone");
    await close();
    await program.stop();
  }
});

test("of a project that is edited: all scenarios together, or the shadow run, and it follows the text", async () => {
  const folder = copy_of("recharge");
  const expected = await coverage(folder);
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await page.getByTestId("design-tree").waitFor();
  await settled(page);
  await page.getByTestId("reached-button").click();
  await until(async () => JSON.stringify(await counts(page)) === JSON.stringify(expected), `as ${JSON.stringify(expected)}`);
  await shot(page, "design-reached");
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption("normal");
  await page.getByRole("combobox", { name: "Whose" }).selectOption("one");
  const one = await coverage(folder, "--scenario", "normal");
  await until(async () => JSON.stringify(await counts(page)) === JSON.stringify(one), `as ${JSON.stringify(one)}`);
  await page.locator('[data-name="GoToStation"].never-ticked').waitFor();
  // An entry opens its file at its line, with the state chosen.
  await page.locator(".reached-kind[data-kind=states]").click();
  const state = page.locator(".reached-lines li", { hasText: "BatteryLevelAbove.scxml" }).first();
  const id = (await state.locator(".mono").first().innerText()).trim();
  await state.locator("button").click();
  await page.locator(`[data-testid=design-chart] [data-id="${id}"].never.chosen`).waitFor();
  // A mission that only succeeds reaches less; undone, as much as before.
  await page.locator('[data-file="mission.xml"]').click();
  await page.locator(".reached-kind[data-kind=nodes]").click();
  await page.locator('[data-never$="GoToKitchen"] button').click();
  await page.locator('[data-name="GoToKitchen"][aria-selected=true]').waitFor();
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("Delete");
  await until(async () => (await counts(page)).nodes !== one.nodes, "another tree, other counts");
  await page.getByTestId("undo").click();
  await until(async () => JSON.stringify(await counts(page)) === JSON.stringify(one), "as before");
  await close();
  await program.stop();
});

test("of every behaviour, as a verification has left it beside its counterexamples and in the project", async () => {
  const folder = copy_of("recharge");
  const verified = await run(["verify", folder, "--faults", "none", "--json"]);
  assert.equal(verified.code, 1, verified.stderr); // nobody need plug in
  const told = JSON.parse(verified.stdout);
  const expected = Object.fromEntries(told.coverage.kinds.map(({ kind, reached, of }) => [kind, `${reached} of ${of}`]));
  assert.equal(Object.keys(expected).length, kinds.length);
  const program = await serve(["studio", join(folder, "verify", "never_empty.mcap")]);
  const { page, close } = await open_page(program.url);
  await page.getByRole("tab", { name: "Reached" }).click();
  await page.getByRole("combobox", { name: "Whose" }).selectOption("every");
  await page.getByTestId("verified").waitFor();
  assert.match(await page.getByTestId("verified").innerText(), new RegExp(`^${told.states.toLocaleString("en")} states of the mission, every behaviour$`));
  assert.deepEqual(await counts(page), expected);
  // What no behaviour does is marked in its chart.
  await page.locator(".reached-kind[data-kind=transitions]").click();
  await page.locator(".reached-lines li button:enabled").first().click();
  await page.locator("#panel-charts .never.sought .arrow").first().waitFor();
  await shot(page, "reached-verified");
  await close();
  await program.stop();
  const design = await serve_design(folder);
  const opened = await open_design(design.url);
  await opened.page.getByTestId("design-tree").waitFor();
  await settled(opened.page);
  await opened.page.getByTestId("reached-button").click();
  await opened.page.getByRole("combobox", { name: "Whose" }).selectOption("every");
  await until(async () => JSON.stringify(await counts(opened.page)) === JSON.stringify(expected), `as ${JSON.stringify(expected)}`);
  assert.doesNotMatch(await opened.page.getByTestId("verified").innerText(), /changed/);
  // Of an edited text it was not.
  await opened.page.locator('[data-testid="design-tree"] [data-name="GoToKitchen"]').click();
  await opened.page.getByTestId("design-tree").focus();
  await opened.page.keyboard.press("Delete");
  await until(async () => /before mission.xml changed/.test(await opened.page.getByTestId("verified").innerText()), "it says that the text is another one");
  await shot(opened.page, "design-reached-verified");
  await opened.close();
  await design.stop();
});

test("of every behaviour, where nobody has verified anything", async () => {
  const folder = copy_of("recharge");
  rmSync(join(folder, "verify"), { recursive: true, force: true });
  const program = await serve_run(folder, { scenario: "normal", args: ["--clock", "virtual", "--factor", "1000"] });
  const { page, close } = await open_page(program.url);
  await page.getByRole("tab", { name: "Reached" }).click();
  await page.getByRole("combobox", { name: "Whose" }).selectOption("every");
  await page.getByText("No verification is there").waitFor();
  await close();
  await program.stop();
});
