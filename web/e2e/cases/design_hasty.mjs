// One who is faster than the program, and one who is not alone: keys that come at once, what others change while one drags,
// names of all kinds, a program that is gone.
import assert from "node:assert/strict";
import { chmodSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { operate, until } from "../harness/browser.mjs";
import { copy_of, drag, middle, node, open_design, serve_design, settled, undo_name } from "../harness/design.mjs";

const names = (page) => page.locator("[data-testid=design-tree] [data-element]").evaluateAll((all) => all.map(({ dataset }) => dataset.name).join(" "));
const begin = async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "Root").waitFor();
  await page.locator('[data-palette="Fallback"]').waitFor();
  return { folder, file: join(folder, "mission.xml"), program, page, close };
};
/** Keys of which each is there before the program has heard of the one before. */
const at_once = (page, keys) =>
  page.getByTestId("design-tree").evaluate((tree, pressed) => {
    tree.focus();
    for (const [key, ctrlKey] of pressed) (document.activeElement ?? tree).dispatchEvent(new KeyboardEvent("keydown", { key, ctrlKey, bubbles: true, cancelable: true }));
  }, keys);

test("keys that come at once are taken one after the other, each of what the one before leaves", async () => {
  const { file, program, page, close } = await begin();
  await node(page, "BatteryLevelAbove30").click();
  await at_once(page, [["d", false], ["d", false], ["d", false]]);
  await until(async () => /^(?:.* )?BatteryLevelAbove30(?: BatteryLevelAbove30){3} BatteryNotRecharging/.test(await names(page)), "three more are there");
  assert.equal(await page.getByTestId("undo").innerText(), "Undo 3");
  await node(page, "BatteryNotRecharging").click();
  await at_once(page, [["ArrowUp", true], ["ArrowUp", true], ["ArrowUp", true], ["ArrowUp", true]]);
  await until(async () => / BatteryNotRecharging BatteryLevelAbove30(?: BatteryLevelAbove30){3} Recharge/.test(await names(page)), "it is before all of them");
  assert.equal(await page.getByTestId("refused").count(), 0);
  // What is typed into a field that such a key opens is typed there.
  await at_once(page, [["ArrowDown", true], ["Enter", false], ..."AlwaysSucc".split("").map((letter) => [letter, false]), ["Enter", false]]);
  await until(async () => / BatteryLevelAbove30 BatteryNotRecharging AlwaysSuccess BatteryLevelAbove30 /.test(await names(page)), "the node with that name is behind it");
  await page.getByTestId("design-tree").focus();
  await at_once(page, Array.from({ length: 12 }, () => ["z", true]));
  await until(async () => (await undo_name(page)) === "", "all is undone");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "nothing is left to save");
  assert.equal(readFileSync(file, "utf8"), readFileSync(join(copy_of("recharge"), "mission.xml"), "utf8"));
  await close();
  await program.stop();
});

test("a key that comes right after the one that closes a dialog is the page's", async () => {
  const { program, page, close } = await begin();
  for (const [opening, dialog] of [["Control+k", ".palette"], ["?", ".help"]]) {
    await page.evaluate(() => document.activeElement?.blur());
    await page.keyboard.press(opening);
    await page.locator(`dialog${dialog}`).waitFor();
    // The second one is there before the page has heard of what the first one did.
    await Promise.all([page.keyboard.press("Escape"), page.keyboard.press("?")]);
    await page.locator("dialog.help").waitFor();
    await page.keyboard.press("Escape");
    await page.locator("dialog").waitFor({ state: "detached" });
  }
  await close();
  await program.stop();
});

test("nodes are copied, cut and pasted; a copy has its place only where it was made", async () => {
  const { program, page, close } = await begin();
  const tree = page.getByTestId("design-tree");
  await tree.focus();
  await page.keyboard.press("Control+v");
  await page.getByTestId("refused").getByText("nothing is copied yet").waitFor();
  await node(page, "AtStation").click();
  await page.keyboard.press("Control+x");
  await node(page, "BeAtKitchen").click();
  await page.keyboard.press("Control+v");
  await until(async () => (await undo_name(page)) === "move AtStation under BeAtKitchen", "it was moved");
  assert.match(await names(page), /BeAtStation GoToStation WaitForUser BeAtKitchen AtKitchen GoToKitchen AtStation$/);
  // Pasted once: what was cut is where it belongs now.
  await page.keyboard.press("Control+v");
  await page.getByTestId("refused").getByText("nothing is copied yet").waitFor();
  await node(page, "GoToStation").click();
  await page.keyboard.press("Control+c");
  await node(page, "WaitForUser").click();
  await page.keyboard.press("Control+v");
  await until(async () => /BeAtStation GoToStation WaitForUser GoToStation BeAtKitchen/.test(await names(page)), "a copy stands behind the leaf");
  await close();
  await program.stop();
});

test("what is dropped is what was taken, whatever others did to the file meanwhile", async () => {
  const { file, program, page, close } = await begin();
  const text = readFileSync(file, "utf8");
  await drag(page, await middle(node(page, "GoToKitchen")), await middle(node(page, "Recharge")));
  await page.getByTestId("drag-label").waitFor();
  // Another editor puts nodes before it: now others have the numbers of these.
  writeFileSync(file, text.replace('<ReactiveSequence name="NoNeed">', '<AlwaysFailure name="First"/>\n        <AlwaysFailure name="Second"/>\n        <ReactiveSequence name="NoNeed">'));
  await node(page, "Second").waitFor();
  const to = await middle(node(page, "Recharge"));
  await page.mouse.move(to.x, to.y, { steps: 2 });
  await page.mouse.up();
  await until(async () => (await undo_name(page)) === "move GoToKitchen under Recharge", "the node that was taken went where it was dropped");
  // What is picked from a list is put where it was asked for, or not at all.
  await node(page, "AtKitchen").click();
  await page.keyboard.press("Enter");
  await page.getByTestId("completer").waitFor();
  writeFileSync(file, text);
  await until(async () => /deleted|changed on disk/.test(await undo_name(page)), "the other editor has put it back");
  await page.keyboard.type("AlwaysSucc");
  await page.keyboard.press("Enter");
  await page.getByTestId("refused").getByText("the text has changed meanwhile").waitFor();
  assert.ok(!(await names(page)).includes("AlwaysSuccess"));
  await close();
  await program.stop();
});

test("names of all kinds stand in the text as they are, in the tree as they are called", async () => {
  const { file, program, page, close } = await begin();
  // Of nodes that nobody else names: not every text could have these.
  for (const [i, name] of ['a "quoted" <angle> & \'b\'', "Küche 🍳🚀", "a ]]> -->", "日本語‮rtl"].entries()) {
    const leaf = page.locator("[data-testid=design-tree] [data-element]").nth([0, 1, 2, 5][i]);
    await leaf.click();
    await page.keyboard.press("F2");
    await page.keyboard.press("Control+a");
    await page.keyboard.insertText(name);
    await page.keyboard.press("Enter");
    await until(async () => (await page.locator("[data-testid=design-tree] [data-element]").nth([0, 1, 2, 5][i]).getAttribute("data-name")) === name, `it is called ${name}`);
  }
  await page.keyboard.press("Control+s");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  const saved = readFileSync(file, "utf8");
  assert.match(saved, /name=(?:"a &quot;quoted&quot; &lt;angle(?:>|&gt;) &amp; 'b'"|'[^']*')/);
  assert.match(saved, /Küche 🍳🚀/);
  assert.equal((await operate(page, "design_read", { file: "mission.xml" })).error, null);
  await close();
  await program.stop();
});

test("a file that is read-only stays as it is, and what is edited is kept; a program that is gone is missed", async () => {
  const { file, program, page, close } = await begin();
  const before = readFileSync(file, "utf8");
  chmodSync(file, 0o444);
  await node(page, "WaitForUser").click();
  await page.keyboard.press("Delete");
  await node(page, "WaitForUser").waitFor({ state: "detached" });
  await page.keyboard.press("Control+s");
  await page.getByTestId("refused").getByText("mission.xml is read-only").waitFor();
  assert.equal(readFileSync(file, "utf8"), before);
  await page.locator('[data-file="mission.xml"][data-dirty=true]').waitFor();
  chmodSync(file, 0o644);
  await page.keyboard.press("Control+s");
  await until(() => !readFileSync(file, "utf8").includes('name="WaitForUser"'), "it is saved");
  await program.stop("SIGKILL");
  await page.locator(".strip.lost").waitFor();
  await close();
});

test("where one designs, Space presses the button that has the focus, and what is found is shown in the files", async () => {
  const { program, page, close } = await begin();
  const autosave = page.getByTestId("autosave");
  await autosave.focus();
  await page.keyboard.press("Space");
  await until(async () => (await autosave.getAttribute("aria-pressed")) === "true", "it is pressed");
  await page.keyboard.press("Space");
  await until(async () => (await autosave.getAttribute("aria-pressed")) === "false", "and once more");
  await settled(page);
  await page.locator('[data-file="skills/WaitForUser.scxml"]').click();
  await page.getByTestId("design-chart").waitFor();
  await page.keyboard.press("Control+k");
  await page.keyboard.type("AtStation");
  // BeAtStation has these letters too, and stands before it.
  await page.getByRole("option", { name: "AtStation" }).nth(1).waitFor();
  await page.keyboard.press("Enter");
  await page.locator('[data-testid=design-tree] [data-name="AtStation"][aria-selected=true]').waitFor();
  assert.equal(await node(page, "AtStation").getAttribute("aria-level"), "5");
  await page.getByRole("button", { name: "Help", exact: true }).click();
  const help = await page.getByRole("dialog").innerText();
  for (const said of ["Wrap AtStation in another node", "Paste into AtStation", "Undo"]) assert.ok(help.includes(said), said);
  assert.ok(!/Go to Monitors/.test(help));
  await close();
  await program.stop();
});
