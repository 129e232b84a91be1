// Several nodes of a tree are chosen at once: by mouse, by a band, by key; what is done is done to all of them, as one step.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { operate, sticks_out, until } from "../harness/browser.mjs";
import { contents, design_of_recharge, drag, middle, node, serious, undo_name } from "../harness/design.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

const chosen = (page) => page.locator("[data-testid=design-tree] [role=treeitem][aria-selected=true]").evaluateAll((all) => all.map(({ dataset }) => dataset.name).sort());
const chosen_are = (page, ...names) => until(async () => (await chosen(page)).join() === names.sort().join(), `${names.join(", ")} are chosen`);
const names = (page) => page.locator("[data-testid=design-tree] [role=treeitem]").evaluateAll((all) => all.map(({ dataset }) => dataset.name).join(" "));
const text_of = async (page) => (await operate(page, "design_read", { file: "mission.xml" })).text;
const step = (page, name) => until(async () => (await undo_name(page)) === name, `“${name}” is done`);
/** One step back, to the same bytes. */
async function taken_back(page, text) {
  await page.keyboard.press("Control+z");
  await until(async () => (await text_of(page)) === text, "one undo brings back each byte");
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
