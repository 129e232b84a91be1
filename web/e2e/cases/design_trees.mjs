// A project of several trees: from a SubTree to its tree and from a leaf to the chart that runs, names that are changed
// wherever they stand, nodes that come from elsewhere.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { state_at } from "../harness/chart.mjs";
import { contents, design_of_recharge, node, open_design, serious, serve_design, settled, undo_name } from "../harness/design.mjs";
import { run, scratch } from "../harness/program.mjs";

const open = (page, file) => page.locator(`.file-row[data-file="${file}"]`).click();
const opened = (page, file) => page.locator(`.file-row[data-file="${file}"][aria-current=true]`).waitFor();
const done = (page, what) => until(async () => (await undo_name(page)) === what, what);
const tree_shown = (page) => page.getByRole("combobox", { name: "Tree" }).inputValue();
const focused = (page) => page.evaluate(() => document.activeElement?.id);

test("a double click leads to what a node is: its chart, its tree, else its name", async () => {
  const { page, close, program } = await design_of_recharge();
  await node(page, "WaitForUser").dblclick();
  await opened(page, "skills/WaitForUser.scxml");
  // Of a state it asks for the name.
  await state_at(page, "waiting").dblclick();
  await until(async () => (await focused(page)) === "design-state", "the state's id is asked for");
  await open(page, "mission.xml");
  await node(page, "Recharge").dblclick();
  await until(async () => (await focused(page)) === "design-name", "the name is asked for");
  await page.keyboard.press("Escape");
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("e");
  await done(page, "make a tree Recharge of Recharge");
  // It is chosen: the same key puts it back, as the menu says.
  await page.locator('[data-testid=design-tree] [data-name="Recharge"][aria-selected=true]').waitFor();
  await page.keyboard.press("m");
  await page.getByRole("menuitem", { name: "Put the tree Recharge in its place" }).waitFor();
  const hidden = await page.getByRole("menu").evaluate((menu) => [...menu.querySelectorAll(".menu-hint")].filter((key) => key.getBoundingClientRect().right > menu.getBoundingClientRect().right).map(({ textContent }) => textContent));
  assert.deepEqual(hidden, [], "keys that are not to be seen");
  await page.keyboard.press("Escape");
  await page.keyboard.press("e");
  await done(page, "put the tree Recharge in the place of Recharge");
  await page.keyboard.press("Control+z");
  await done(page, "make a tree Recharge of Recharge");
  await node(page, "Recharge").dblclick();
  await until(async () => (await tree_shown(page)) === "Recharge", "its tree is shown");
  await node(page, "WaitForUser").waitFor();
  await page.getByRole("combobox", { name: "Tree" }).selectOption("Main");
  await node(page, "Recharge").click();
  await page.getByRole("button", { name: "Open its tree" }).click();
  await until(async () => (await tree_shown(page)) === "Recharge", "its tree is shown");
  await close();
  await program.stop();
});

test("a tree of its own has the name of no node, which BehaviorTree.CPP refuses", async () => {
  const { page, close, program, folder } = await design_of_recharge();
  await node(page, "WaitForUser").click();
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("w");
  await page.keyboard.type("Inver");
  await page.keyboard.press("Enter");
  await done(page, "wrap WaitForUser in Inverter");
  await page.locator('[data-testid=design-tree] [aria-selected=true]', { hasText: "Inverter" }).waitFor();
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("e");
  await done(page, "make a tree InverterTree of Inverter");
  await page.getByTestId("save").click();
  await until(() => contents(folder)["mission.xml"].includes('<BehaviorTree ID="InverterTree">'), "it is saved");
  await close();
  await program.stop();
  const checked = await run(["check", folder]);
  assert.doesNotMatch(checked.stdout + checked.stderr, /tree-named-as-node|has the name of a node/);
  // Who gives it such a name by hand is told.
  const file = join(folder, "mission.xml");
  writeFileSync(file, readFileSync(file, "utf8").replaceAll("InverterTree", "Inverter"));
  const told = await run(["check", folder]);
  assert.match(told.stdout + told.stderr, /BehaviorTree "Inverter" has the name of a node that is built in/);
});

test("a leaf leads to the chart that its scenario runs, wherever that lies", async () => {
  const { page, close, program } = await design_of_recharge();
  const button = page.getByRole("button", { name: /^Open its chart/ });
  await node(page, "BatteryLevelAbove30").click();
  await button.and(page.getByTitle(/^skills\/BatteryLevelAbove\.scxml/)).waitFor();
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption("experiment2");
  await settled(page);
  await page.getByRole("button", { name: "Open its chart: BatteryLevelAbove-buggy" }).click();
  await opened(page, "skills/BatteryLevelAbove-buggy.scxml");
  await page.keyboard.press("Control+k");
  await page.keyboard.type("Rename skills/BatteryLevelAbove-buggy");
  await page.keyboard.press("Enter");
  await page.getByRole("textbox", { name: /^New name of/ }).fill("skills/Bad.scxml");
  await page.keyboard.press("Enter");
  await opened(page, "skills/Bad.scxml");
  await settled(page);
  await open(page, "mission.xml");
  await node(page, "BatteryLevelAbove30").dblclick();
  await opened(page, "skills/Bad.scxml");
  await close();
  await program.stop();
});

test("a tree is added, filled, named anew wherever it is named, and deleted once nobody uses it", async () => {
  const { page, close, program, folder } = await design_of_recharge();
  const original = readFileSync(join(folder, "mission.xml"), "utf8");
  await page.locator("#design-new-tree").fill("Rest");
  await page.keyboard.press("Enter");
  await done(page, "add a tree Rest");
  await until(async () => (await tree_shown(page)) === "Rest", "it is shown");
  assert.deepEqual(await serious(page), []);
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("Enter");
  await page.getByTestId("completer").waitFor();
  await page.keyboard.type("WaitForU");
  await page.keyboard.press("Enter");
  await node(page, "WaitForUser").waitFor();
  await page.getByRole("combobox", { name: "Tree" }).selectOption("Main");
  await node(page, "Recharge").click();
  await page.locator('[data-palette="Rest"]').dblclick();
  await done(page, "add Rest to Recharge");
  await node(page, "Rest").dblclick();
  await until(async () => (await tree_shown(page)) === "Rest", "it is shown");
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Delete the tree Rest" }).click();
  await page.getByTestId("refused").getByText("1 SubTree is of the tree Rest").waitFor();
  await page.locator("#design-tree-id").fill("Pause");
  await page.keyboard.press("Enter");
  await done(page, "rename Rest to Pause");
  await until(async () => (await tree_shown(page)) === "Pause", "the picture stays with it");
  await page.getByRole("combobox", { name: "Tree" }).selectOption("Main");
  await node(page, "Pause").click();
  await page.keyboard.press("Delete");
  await done(page, "delete Pause");
  await page.getByRole("combobox", { name: "Tree" }).selectOption("Pause");
  await page.getByRole("button", { name: "Delete the tree Pause" }).click();
  await done(page, "delete the tree Pause");
  await page.getByRole("combobox", { name: "Tree" }).waitFor({ state: "detached" });
  await page.getByTestId("save").waitFor();
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "it is as it was");
  assert.equal(readFileSync(join(folder, "mission.xml"), "utf8"), original);
  await close();
  await program.stop();
});

/** Until nothing is left to be undone. */
async function undo_all(page) {
  while ((await undo_name(page)) !== "") {
    const name = await page.getByTestId("undo").innerText();
    await page.getByTestId("undo").click();
    await until(async () => (await page.getByTestId("undo").innerText()) !== name, "undone");
  }
}
async function save(page) {
  await page.keyboard.press("Control+s");
  await until(async () => (await page.locator("[data-file][data-dirty=true]").count()) === 0, "all is saved");
}
/** The files that are another than before. */
const changed = (before, now) => Object.keys(now).filter((file) => now[file] !== before[file]).sort();

/** Of the project these files are others now, by the name alone (but for `other`); undone, every byte is back. */
async function is_renamed(page, folder, before, files, back, other = "") {
  await page.getByTestId("problems").getByText("no problems").waitFor();
  await save(page);
  const after = contents(folder);
  assert.deepEqual(changed(before, after), files);
  for (const file of files.filter((name) => name !== other)) assert.equal(back(after[file]), before[file], file);
  assert.equal((await run(["check", folder])).code, 0);
  await undo_all(page);
  await save(page);
  assert.deepEqual(contents(folder), before);
}

test("a node gets another name where monitors and requirements name it, too; undone, every byte is back", async () => {
  const { page, close, program, folder } = await design_of_recharge();
  const before = contents(folder);
  await node(page, "BatteryLevelAbove30").click();
  await page.keyboard.press("F2");
  await page.keyboard.press("Control+a");
  await page.keyboard.type("EnoughEnergy");
  await page.keyboard.press("Enter");
  await node(page, "EnoughEnergy").waitFor();
  await done(page, "rename BatteryLevelAbove30 to EnoughEnergy");
  await settled(page);
  await is_renamed(page, folder, before, ["mission.xml", "monitors/battery.scxml", "monitors/recharge.scxml", "requirements/published.req", "requirements/recharge.req"], (text) => text.replaceAll("EnoughEnergy", "BatteryLevelAbove30"), "monitors/battery.scxml");
  await close();
  await program.stop();
});

test("a monitor's state gets another name where sentree.yaml names it, too; undone, every byte is back", async () => {
  const folder = join(scratch(), "robot");
  assert.equal((await run(["init", folder])).code, 0);
  const before = contents(folder);
  assert.match(before["sentree.yaml"], /two_goals/);
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "monitors/one_goal_at_a_time.scxml" });
  await settled(page);
  await state_at(page, "two_goals").dblclick();
  await until(async () => (await focused(page)) === "design-state", "the state's id is asked for");
  await page.keyboard.press("Control+a");
  await page.keyboard.type("two_at_once");
  await page.keyboard.press("Enter");
  await state_at(page, "two_at_once").waitFor();
  await done(page, "rename two_goals to two_at_once");
  // It is still the one that is chosen.
  await until(async () => (await page.locator("#design-state").inputValue()) === "two_at_once", "it is chosen");
  await settled(page);
  await is_renamed(page, folder, before, ["monitors/one_goal_at_a_time.scxml", "sentree.yaml"], (text) => text.replaceAll("two_at_once", "two_goals"));
  await close();
  await program.stop();
});

test("what other files and editors have is pasted as nodes; what is copied can be pasted there", async () => {
  const other = '<root BTCPP_format="4">\n  <BehaviorTree ID="Other">\n    <Fallback name="Empty"/>\n  </BehaviorTree>\n</root>\n';
  const { page, close, program, folder } = await design_of_recharge((folder) => writeFileSync(join(folder, "other.xml"), other));
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  const clipboard = (text) => page.evaluate((given) => navigator.clipboard.writeText(given), text);
  // As Groot has it: a file.
  await clipboard('<?xml version="1.0"?>\r\n<root BTCPP_format="4">\r\n  <BehaviorTree ID="T">\r\n    <Sequence name="Pasted">\r\n      <AlwaysSuccess/>\r\n    </Sequence>\r\n  </BehaviorTree>\r\n</root>\r\n');
  await node(page, "Recharge").click();
  await page.keyboard.press("Control+v");
  await done(page, "paste Pasted under Recharge");
  await clipboard("<WaitForUser");
  await page.keyboard.press("Control+v");
  await page.getByTestId("refused").getByText("what was copied is no XML of nodes").waitFor();
  await clipboard("two words");
  await page.keyboard.press("Control+v");
  await page.getByTestId("refused").getByText("what is in the clipboard is no node: “two words”").waitFor();
  await clipboard('<scxml xmlns="http://www.w3.org/2005/07/scxml"><state id="a"/></scxml>');
  await page.keyboard.press("Control+v");
  await page.getByTestId("refused").getByText("<scxml> is no node of a tree").waitFor();
  // From one file of the project to another.
  await node(page, "BeAtStation").click();
  await page.keyboard.press("Control+c");
  await until(async () => (await page.evaluate(() => navigator.clipboard.readText())).includes("BeAtStation"), "it is in the clipboard");
  await open(page, "other.xml");
  await node(page, "Empty").click();
  await page.keyboard.press("Control+v");
  await done(page, "paste BeAtStation under Empty");
  await page.keyboard.press("Control+s");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  assert.match(readFileSync(join(folder, "other.xml"), "utf8"), /\n {4}<Fallback name="Empty">\n {6}<ReactiveFallback name="BeAtStation">\n {8}<AtLocation [^>]*>\n {8}<GoToLocation [^>]*>\n {6}<\/ReactiveFallback>\n {4}<\/Fallback>\n/);
  assert.match(readFileSync(join(folder, "mission.xml"), "utf8"), /\n {10}<Sequence name="Pasted">\n {12}<AlwaysSuccess\/>\n {10}<\/Sequence>\n/);
  await close();
  await program.stop();
});
