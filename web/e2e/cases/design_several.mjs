// Several nodes of a tree, or states of a chart, are chosen at once: by mouse, by a band, by key; what is done is done to
// all of them, as one step.
import assert from "node:assert/strict";
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { operate, sticks_out, until } from "../harness/browser.mjs";
import { kOwnChart, carry_state, choose_in_menu, state_at } from "../harness/chart.mjs";
import { contents, design_of_recharge, drag, middle, node, serious, settled, undo_name } from "../harness/design.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

const chosen = (page) => page.locator("[data-testid=design-tree] [role=treeitem][aria-selected=true]").evaluateAll((all) => all.map(({ dataset }) => dataset.name).sort());
const chosen_are = (page, ...names) => until(async () => (await chosen(page)).join() === names.sort().join(), `${names.join(", ")} are chosen`);
const names = (page) => page.locator("[data-testid=design-tree] [role=treeitem]").evaluateAll((all) => all.map(({ dataset }) => dataset.name).join(" "));
const text_of = async (page, file = "mission.xml") => (await operate(page, "design_read", { file })).text;
const step = (page, name) => until(async () => (await undo_name(page)) === name, `“${name}” is done`);
/** One step back, to the same bytes. */
async function taken_back(page, text, file) {
  await page.keyboard.press("Control+z");
  await until(async () => (await text_of(page, file)) === text, "one undo brings back each byte");
}

test("what is chosen with Shift, Ctrl or a band is deleted, wrapped, moved, copied and disabled as one", async () => {
  const { folder, program, page, close } = await design_of_recharge();
  const original = contents(folder);
  const text = await text_of(page);
  const all = await names(page);

  // A click, another one with Shift, a third one with Ctrl; again is no more.
  await node(page, "AtStation").click();
  await node(page, "GoToStation").click({ modifiers: ["Shift"] });
  await node(page, "WaitForUser").click({ modifiers: ["Control"] });
  await chosen_are(page, "AtStation", "GoToStation", "WaitForUser");
  await node(page, "WaitForUser").click({ modifiers: ["Shift"] });
  await chosen_are(page, "AtStation", "GoToStation");
  await page.getByTestId("inspector-several").getByText("2 nodes", { exact: true }).waitFor();
  assert.deepEqual(await serious(page), []);
  await page.setViewportSize({ width: 1024, height: 700 });
  await page.locator(".design[data-narrow=true]").waitFor();
  assert.deepEqual(await sticks_out(page), []);
  await page.setViewportSize({ width: 1440, height: 900 });
  if (pictures) await page.screenshot({ path: join(pictures, "several.png") });

  // Wrapped in one node, and all of it undone by one step.
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("w");
  await page.keyboard.type("Sequence");
  await page.keyboard.press("Enter");
  await step(page, "wrap 2 nodes in Sequence");
  assert.match(await text_of(page), /\n {12}<Sequence>\n {14}<AtLocation name="AtStation"[^\n]*\n {14}<GoToLocation name="GoToStation"[^\n]*\n {12}<\/Sequence>\n/);
  await chosen_are(page, "Sequence");
  await taken_back(page, text);

  // Deleted: what was around them is as it was.
  await node(page, "NoNeed").click();
  await node(page, "WaitForUser").click({ modifiers: ["Shift"] });
  await page.keyboard.press("Delete");
  await step(page, "delete 2 nodes");
  assert.equal(await names(page), all.replace(" NoNeed BatteryLevelAbove30 BatteryNotRecharging", "").replace(" WaitForUser", ""));
  await taken_back(page, text);

  // A band on the floor takes what is in it as a whole.
  const [at, to] = [await middle(node(page, "AtKitchen")), await middle(node(page, "GoToKitchen"))];
  const left_top = { x: Math.min(at.box.x, to.box.x) - 12, y: Math.min(at.box.y, to.box.y) - 12 };
  const right_bottom = { x: Math.max(at.box.x + at.box.width, to.box.x + to.box.width) + 12, y: Math.max(at.box.y + at.box.height, to.box.y + to.box.height) + 12 };
  await page.keyboard.down("Shift");
  await drag(page, left_top, right_bottom);
  await page.getByTestId("band").waitFor();
  await page.mouse.up();
  await page.keyboard.up("Shift");
  assert.equal(await page.getByTestId("band").count(), 0);
  await until(async () => {
    const now = await chosen(page);
    return now.includes("AtKitchen") && now.includes("GoToKitchen") && !now.includes("Recharge");
  }, "both are chosen");

  // Dragged by one of them, all go along, in their order; they stay chosen.
  await node(page, "AtKitchen").click();
  await node(page, "GoToKitchen").click({ modifiers: ["Shift"] });
  await drag(page, await middle(node(page, "GoToKitchen")), await middle(node(page, "Recharge")));
  await page.getByTestId("drag-label").getByText("2 nodes").waitFor();
  await page.mouse.up();
  await step(page, "move 2 nodes under Recharge");
  assert.match(await names(page), /WaitForUser AtKitchen GoToKitchen BeAtKitchen$/);
  await chosen_are(page, "AtKitchen", "GoToKitchen");
  // Before their sibling, by key.
  await page.keyboard.press("Control+ArrowUp");
  await until(async () => /AtKitchen GoToKitchen WaitForUser/.test(await names(page)), "they stand before their sibling");
  await chosen_are(page, "AtKitchen", "GoToKitchen");
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  await until(async () => (await text_of(page)) === text, "two undos bring back each byte");

  // Copied and pasted; copies have names of their own.
  await node(page, "AtKitchen").click();
  await node(page, "GoToKitchen").click({ modifiers: ["Shift"] });
  await page.keyboard.press("Control+c");
  await node(page, "Recharge").click();
  await page.keyboard.press("Control+v");
  await step(page, "copy 2 nodes under Recharge");
  await chosen_are(page, "AtKitchen_2", "GoToKitchen_2");
  await taken_back(page, text);

  // Disabled, and enabled again.
  await node(page, "AtKitchen").click();
  await page.keyboard.press("Shift+ArrowRight");
  await until(async () => (await chosen(page)).length === 2, "Shift and an arrow choose the next one, too");
  await page.keyboard.press("s");
  await until(async () => /^set _skipIf/.test(await undo_name(page)), "they are disabled");
  assert.equal((await text_of(page)).match(/_skipIf="true"/g).length, 2);
  await page.keyboard.press("s");
  await until(async () => (await text_of(page)) === text, "they are enabled again");

  // What is meant of one node alone is refused; Escape chooses nothing.
  await page.keyboard.press("F2");
  await page.getByTestId("refused").getByText("2 nodes are chosen").waitFor();
  await page.keyboard.press("Control+a");
  await until(async () => (await chosen(page)).length === all.split(" ").length, "all are chosen");
  await page.keyboard.press("Escape");
  assert.deepEqual(await chosen(page), []);
  // A click on one of several means it alone.
  await page.keyboard.press("Control+a");
  await node(page, "Recharge").click();
  await chosen_are(page, "Recharge");

  assert.deepEqual(contents(folder), original);
  await close();
  await program.stop();
});

const kChart = kOwnChart
  .replace(' xmlns:qt="http://www.qt.io" qt:editorinfo="geometry:1;2"', "")
  .replace('event="go"', `event="go" cond="In('moving')"`);
const kFile = "skills/Own.scxml";

test("states of a chart are chosen with Shift, Ctrl or a band, and deleted, moved, copied and put into a new one as one", async () => {
  const { folder, program, page, close } = await design_of_recharge((prepared) => writeFileSync(join(prepared, kFile), kChart));
  const original = contents(folder);
  await page.locator(`[data-file="${kFile}"]`).first().click();
  await state_at(page, "moving").waitFor();
  await settled(page);
  const name = (id) => state_at(page, id).locator(".name").first();
  const states = () => page.locator("[data-testid=design-chart] [data-id].chosen").evaluateAll((all) => all.map(({ dataset }) => dataset.id).sort());
  const states_are = (...ids) => until(async () => (await states()).join() === ids.sort().join(), `${ids.join(", ")} are chosen`);
  const there = (count) => until(async () => (await page.locator('[data-testid=design-chart] [data-id]:not([data-id=""])').count()) === count, `${count} states are there`);

  // A click, others with Shift and Ctrl; again is no more.
  await name("moving").click();
  await name("idle").click({ modifiers: ["Shift"] });
  await name("out").click({ modifiers: ["Control"] });
  await states_are("moving", "idle", "out");
  await name("out").click({ modifiers: ["Shift"] });
  await states_are("moving", "idle");
  await page.getByTestId("states-form").getByText("2 states", { exact: true }).waitFor();
  assert.deepEqual(await serious(page), []);
  for (const [width, height] of [[1024, 700], [1440, 900]]) {
    await page.setViewportSize({ width, height });
    assert.deepEqual(await sticks_out(page), []);
  }
  if (pictures) await page.screenshot({ path: join(pictures, "several-states.png") });

  // Put into a new state, with what stands between them; its id is asked for.
  await page.getByTestId("design-chart").focus();
  await page.keyboard.press("w");
  await until(() => page.evaluate(() => document.activeElement?.id === "design-state"), "its id is asked for");
  await step(page, "put 2 states into the new state state1");
  assert.match(await text_of(page, kFile), /\n {2}<state id="state1">\n {4}<state id="moving">\n {6}<transition event='tick' target='idle'\/> <!-- stops -->\n[^]*\n {4}<state id="idle"><transition event="go" cond="In\('moving'\)" target="moving"\/><\/state>\n {2}<\/state>\n/);
  await page.keyboard.press("Enter");
  await taken_back(page, kChart, kFile);

  // Dragged by one of them, all go along; they stay chosen.
  await name("idle").click();
  await name("moving").click({ modifiers: ["Shift"] });
  await carry_state(page, "idle", await middle(name("trip")));
  await until(async () => (await page.getByTestId("drag-label").innerText()) === "2 states → trip", "it says what goes where");
  await page.mouse.up();
  await step(page, "move 2 states into trip");
  await states_are("moving", "idle");
  await taken_back(page, kChart, kFile);

  // A band takes what is in it as a whole, also inside of a state.
  const { box } = await middle(state_at(page, "trip").locator("rect").first());
  await page.keyboard.press("Escape");
  await page.keyboard.down("Shift");
  await drag(page, { x: box.x + 12, y: box.y + box.height - 12 }, { x: box.x + box.width - 12, y: box.y + 12 });
  await page.getByTestId("band").waitFor();
  await page.mouse.up();
  await page.keyboard.up("Shift");
  assert.equal(await page.getByTestId("band").count(), 0);
  await states_are("out", "back");
  // Duplicated beside themselves, under ids of their own, which are chosen then.
  await page.keyboard.press("d");
  await step(page, "paste 2 states into trip");
  await there(8);
  await states_are("out_2", "back_2");
  await taken_back(page, kChart, kFile);

  // Copied and pasted: what they name of each other are the copies.
  await name("moving").click();
  await name("idle").click({ modifiers: ["Shift"] });
  await page.keyboard.press("Control+c");
  await name("trip").click();
  await page.keyboard.press("Control+v");
  await step(page, "paste 2 states into trip");
  assert.match(await text_of(page, kFile), /<state id="moving_2">\n {6}<transition event='tick' target='idle_2'\/> <!-- stops -->\n {6}<transition event="halt" target="halted"\/>\n {4}<\/state>\n {4}<state id="idle_2"><transition event="go" cond="In\('moving_2'\)" target="moving_2"\/><\/state>\n {2}<\/state>/);
  await taken_back(page, kChart, kFile);

  // Cut and pasted: they are elsewhere, under the ids that they had.
  await name("moving").click();
  await page.keyboard.press("a");
  await states_are("moving", "idle");
  await page.keyboard.press("Control+x");
  await name("trip").click();
  await page.keyboard.press("Control+v");
  await step(page, "move 2 states into trip");
  await taken_back(page, kChart, kFile);

  // By menu, on what is chosen already.
  await name("moving").click();
  await name("halted").click({ modifiers: ["Control"] });
  await name("moving").click({ button: "right" });
  await choose_in_menu(page, "Delete Del");
  await step(page, "delete 2 states with 1 transition to them");
  await there(4);
  await taken_back(page, kChart, kFile);

  // What is meant of one state alone is refused; a click means one alone, Escape none.
  await page.getByTestId("design-chart").focus();
  await page.keyboard.press("Control+a");
  await states_are("moving", "idle", "trip", "out", "back", "halted");
  await page.keyboard.press("F2");
  await page.getByTestId("refused").getByText("6 states are chosen").waitFor();
  await name("idle").click();
  await states_are("idle");
  await page.keyboard.press("Control+a");
  await page.keyboard.press("Escape");
  assert.deepEqual(await states(), []);

  assert.deepEqual(contents(folder), original);
  await close();
  await program.stop();
});
