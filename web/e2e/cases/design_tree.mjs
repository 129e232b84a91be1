// The tree is edited by mouse and by keyboard; what cannot be says why.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { draw_state, draw_transition, state_at } from "../harness/chart.mjs";
import { copy_of, drag, middle, node, open_design, serious, serve_design, settled, undo_name } from "../harness/design.mjs";
import { run, scratch } from "../harness/program.mjs";

const text_shown = (page) => page.locator(".cm-content").evaluate((element) => element.cmTile?.view?.state.doc.toString() ?? element.innerText);

test("impossible drops say why while one drags, and change nothing", async () => {
  const folder = copy_of("recharge");
  const file = join(folder, "mission.xml");
  writeFileSync(
    file,
    readFileSync(file, "utf8")
      .replace('<WaitForUser name="WaitForUser"/>', '<Inverter name="Not"><WaitForUser name="WaitForUser"/></Inverter>')
      .replace("</BehaviorTree>", '</BehaviorTree>\n  <BehaviorTree ID="Other"><AlwaysSuccess/></BehaviorTree>'),
  );
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await page.locator('[data-palette="Fallback"]').waitFor();
  const before = await text_shown(page);
  const refused = async (from, onto, why) => {
    const to = await middle(onto);
    await drag(page, await middle(from), to);
    await until(async () => why.test(await page.getByTestId("drag-label").innerText().catch(() => "")), `it says ${why}`);
    const label = await page.getByTestId("drag-label").boundingBox();
    assert.ok(Math.hypot(label.x - to.x, label.y - to.y) < 30, "it is said at the pointer");
    await page.mouse.up();
    await until(async () => (await page.getByTestId("drag-label").count()) === 0, "the drag is over");
    assert.equal(await text_shown(page), before);
  };
  await refused(page.locator('[data-palette="AlwaysSuccess"]'), node(page, "Not"), /one child only/);
  await refused(page.locator('[data-palette="AlwaysSuccess"]'), node(page, "AtKitchen"), /condition: it has no children/);
  await refused(page.locator('[data-palette="Main"]'), node(page, "Recharge"), /would contain itself/);
  await refused(node(page, "Recharge"), node(page, "BeAtStation"), /into itself/);
  assert.equal(await undo_name(page), "");
  // What is possible says which node takes it, and where.
  const recharge = await middle(node(page, "Recharge"));
  await drag(page, await middle(page.locator('[data-palette="AlwaysSuccess"]')), { x: recharge.box.x + recharge.box.width + 12, y: recharge.y });
  await until(async () => /into EnergyOk, after Recharge/.test(await page.getByTestId("drag-label").innerText()), "the place is said");
  const framed = await page.locator("[data-testid=slot-mark] rect").boundingBox();
  const { box } = await middle(node(page, "EnergyOk"));
  assert.ok(framed.x <= box.x && framed.x + framed.width >= box.x + box.width, "the node that takes it is framed");
  await page.keyboard.press("Escape");
  await page.mouse.up();

  // What is dropped has the next keys; after it is deleted, the node beside it.
  const focused = () => page.evaluate(() => document.activeElement?.dataset.testid);
  const chosen = () => page.locator("[data-testid=design-tree] [aria-selected=true]").getAttribute("data-name");
  await drag(page, await middle(page.locator('[data-palette="AlwaysSuccess"]')), { x: recharge.box.x + recharge.box.width + 12, y: recharge.y });
  await page.mouse.up();
  await node(page, "AlwaysSuccess").waitFor();
  assert.equal(await focused(), "design-tree");
  await page.keyboard.press("Delete");
  await until(async () => (await node(page, "AlwaysSuccess").count()) === 0, "it is deleted");
  await until(async () => ["Recharge", "EnergyOk"].includes(await chosen()), "the node beside it is chosen");
  // By key, and by the right button.
  await node(page, "Recharge").click();
  await page.locator(".design-palette .scroll").focus();
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)).endsWith("to Recharge"), "it is below the chosen node");
  assert.equal(await focused(), "design-tree");
  await page.keyboard.press("Control+z");
  await until(async () => (await undo_name(page)).startsWith("delete"), "it is undone");
  await node(page, "Recharge").click({ button: "right" });
  await page.getByRole("menuitem", { name: "Rename Recharge" }).click();
  await until(() => page.evaluate(() => document.activeElement?.id === "design-name" && document.activeElement.selectionStart === 0 && document.activeElement.selectionEnd > 0), "the name is selected");
  await page.keyboard.press("Escape");
  while ((await undo_name(page)) !== "") {
    const before_undo = await undo_name(page);
    await page.getByTestId("undo").click();
    await until(async () => (await undo_name(page)) !== before_undo, "undone");
  }
  await page.keyboard.press("Control+z");
  await page.getByText("there is nothing to undo").waitFor();
  assert.equal(await page.getByTestId("refused").count(), 0);
  await close();
  await program.stop();
});

test("without a mouse a node gets a place, a name and ports, and a chart a state and a transition", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "Root").waitFor();
  const focused = () => page.evaluate(() => document.activeElement?.id || document.activeElement?.dataset.testid);
  const command = async (title) => {
    await page.keyboard.press("Control+k");
    await page.getByRole("dialog").waitFor();
    await page.keyboard.type(title);
    await page.getByRole("option", { name: title }).first().waitFor();
    await page.keyboard.press("Enter");
    await page.locator("#palette-list").waitFor({ state: "detached" });
  };
  const at = (where) => until(async () => (await focused()) === where, `${where} has the focus`);
  const done = (what) => until(async () => (await undo_name(page)) === what, what);
  await command("Go to the tree");
  await at("design-tree");
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowDown");
  await command("Add a node after");
  await page.getByTestId("completer").waitFor();
  await page.keyboard.type("GoToLoc");
  await page.keyboard.press("Enter");
  await node(page, "GoToLocation").waitFor();
  await command("Rename GoToLocation");
  await at("design-name");
  await page.keyboard.press("Control+a");
  await page.keyboard.type("GoToStudy");
  await page.keyboard.press("Tab");
  await node(page, "GoToStudy").waitFor();
  await at("design-port-destination");
  await page.keyboard.type("study");
  await page.keyboard.press("Enter");
  await done("set destination of GoToStudy");
  await command("Move GoToStudy before its sibling");
  await done("move GoToStudy within Root");
  await at("design-tree");
  await page.keyboard.press("Delete");
  await done("delete GoToStudy");
  await page.keyboard.press("Control+z");
  await done("move GoToStudy within Root");

  await command("Open skills/GoToLocation.scxml");
  await page.getByTestId("design-chart").waitFor();
  await command("Add a state");
  await at("design-new-state");
  await page.keyboard.type("resting");
  await page.keyboard.press("Enter");
  await state_at(page, "resting").waitFor();
  await command("Go to the chart");
  await at("design-chart");
  await page.keyboard.press("n");
  await at("design-event");
  await page.keyboard.type("halt");
  await page.keyboard.press("Tab");
  await page.keyboard.press("Tab");
  await at("design-target");
  await page.keyboard.type("halted");
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await page.getByRole("button", { name: "halt → halted" }).waitFor();
  assert.deepEqual(await serious(page), []);
  await page.keyboard.press("Control+s");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  assert.match(readFileSync(join(folder, "mission.xml"), "utf8"), /<GoToLocation name="GoToStudy" destination="study"/);
  assert.match(readFileSync(join(folder, "skills/GoToLocation.scxml"), "utf8"), /<state id="resting">\s*<transition event="halt" target="halted"\/>/);
  await close();
  await program.stop();
});

test("by keyboard alone a tree gets nodes, moves, wraps, renames and loses them", async () => {
  const folder = copy_of("recharge");
  const original = readFileSync(join(folder, "mission.xml"), "utf8");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "Root").waitFor();
  await page.locator('[data-palette="Fallback"]').waitFor();
  await page.getByTestId("design-tree").focus();
  const chosen = () => page.locator("[data-testid=design-tree] [aria-selected=true]").getAttribute("data-name");
  await page.keyboard.press("Home");
  await until(async () => (await chosen()) === "Root", "the root is chosen");
  // To its first child, whichever way the tree is drawn.
  await page.keyboard.press("ArrowRight");
  if ((await chosen()) === "Root") await page.keyboard.press("ArrowDown");
  await until(async () => (await chosen()) !== "Root", "a child is chosen");
  await node(page, "EnergyOk").click();
  await until(async () => (await chosen()) === "EnergyOk", "a node is chosen");
  // A sibling after it, by typing the beginning of its name.
  await page.keyboard.press("Enter");
  await page.getByTestId("completer").waitFor();
  await page.keyboard.type("Parall");
  await page.keyboard.press("Enter");
  await until(async () => (await chosen()) === "Parallel", "a node was added, and is chosen");
  // A child in it.
  await page.keyboard.press("Tab");
  await page.keyboard.type("AlwaysSucc");
  await page.keyboard.press("Enter");
  await until(async () => (await chosen()) === "AlwaysSuccess", "a child was added");
  await page.keyboard.press("w");
  await page.keyboard.type("Inver");
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)) === "wrap AlwaysSuccess in Inverter", "it was wrapped");
  await until(async () => (await chosen()) === "Inverter", "what wraps it is chosen");
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("F2");
  await page.keyboard.type("Not");
  await page.keyboard.press("Enter");
  await node(page, "Not").waitFor();
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("u");
  await until(async () => (await node(page, "Not").count()) === 0, "it was unwrapped");
  await node(page, "Parallel").click();
  await page.keyboard.press("Control+ArrowDown");
  await until(async () => /move Parallel within Root/.test(await undo_name(page)), "it moved");
  await page.keyboard.press("Delete");
  await until(async () => (await node(page, "Parallel").count()) === 0, "it is gone");
  await until(async () => /^delete/.test(await undo_name(page)), "and that can be undone");
  for (;;) {
    const name = await undo_name(page);
    if (name === "") break;
    await page.keyboard.press("Control+z");
    await until(async () => (await undo_name(page)) !== name, "undone");
  }
  assert.equal(readFileSync(join(folder, "mission.xml"), "utf8"), original);
  await page.locator('[data-file="mission.xml"][data-dirty=false]').waitFor();
  await close();
  await program.stop();
});

test("a robot from nothing: a leaf, its chart drawn by mouse, a requirement and a scenario pass check and test", async () => {
  const began = Date.now();
  const folder = scratch();
  const git = (...args) => execFileSync("git", ["-C", folder, "-c", "user.name=a", "-c", "user.email=a@b", ...args], { encoding: "utf8" });
  git("init", "-q");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  // There is nothing yet that a part could belong to.
  await page.locator(".project-tree").getByRole("button", { name: "Add a skill" }).click();
  await page.keyboard.type("Early");
  await page.keyboard.press("Enter");
  await page.getByTestId("refused").getByText("begin a project first").waitFor();
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Begin a project that runs" }).click();
  await page.getByTestId("design-tree").waitFor();
  await page.locator('[data-palette="Fallback"]').waitFor();
  await settled(page);
  git("add", "-A");
  git("commit", "-qm", "begin");
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("Tab");
  await page.getByTestId("completer").waitFor();
  await page.keyboard.type("Dock");
  await page.keyboard.press("Enter");
  await node(page, "Dock").waitFor();
  await settled(page);

  // Its chart: four states of our own in place of the one that only waits.
  await node(page, "Dock").click();
  await page.getByRole("button", { name: "Open its chart" }).click();
  await state_at(page, "waiting").waitFor();
  const before = await page.locator("[data-testid=design-chart] [data-id]").count();
  const own = ["approach", "align", "touch", "rest"];
  for (const [i, id] of own.entries()) await draw_state(page, id, before + i + 1);
  await state_at(page, "approach").click({ button: "right" });
  await page.getByRole("menuitemcheckbox", { name: "The chart begins with it" }).click();
  await until(async () => (await undo_name(page)) === "begin with approach", "the chart begins elsewhere");
  await state_at(page, "waiting").click();
  await page.keyboard.press("Delete");
  await state_at(page, "waiting").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Picture", exact: true }).click();
  await page.locator(".code").waitFor({ state: "detached" });
  const way = [...own, "success"];
  for (let i = 0; i + 1 < way.length; i++) await draw_transition(page, way[i], way[i + 1], "tick", i === 1 ? "_event.name === 'tick'" : "");
  for (const id of own) await draw_transition(page, id, "halted", "halt");
  await draw_transition(page, "align", "failure", "error.execution");
  await page.getByRole("button", { name: "Both", exact: true }).click();
  await settled(page);

  for (const [part, name] of [["requirement", "answers"], ["scenario", "docks"]]) {
    await page.getByRole("button", { name: `Add a ${part}` }).click();
    await page.getByRole("textbox", { name: `Name of the new ${part}` }).fill(name);
    await page.keyboard.press("Enter");
    await page.locator(`[data-file="${part}s/${name}.${part === "scenario" ? "yaml" : "req"}"][aria-current=true]`).waitFor();
  }
  await page.getByTestId("save").click();
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption("docks");
  await settled(page);
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator('[data-testid=tree] [aria-label^="Dock"]').waitFor();
  await page.getByRole("button", { name: "Design", exact: true }).click();
  await page.locator(".design").waitFor();
  await close();
  await program.stop();
  console.log(`# from nothing to a robot that docks: ${((Date.now() - began) / 1000).toFixed(0)} s`);
  const chart = readFileSync(join(folder, "skills/Dock.scxml"), "utf8");
  assert.match(chart, /<transition event="tick" cond="_event\.name === 'tick'" target="touch"\/>/);
  const checked = await run(["check", folder]);
  assert.equal(checked.code, 0, checked.stdout);
  const tested = await run(["test", folder]);
  assert.equal(tested.code, 0, tested.stdout + tested.stderr);
  assert.match(tested.stdout, /docks/);
  const changed = git("status", "--porcelain", "-uall").trim().split("\n").map((line) => line.trim().split(" ").at(-1));
  assert.deepEqual(changed.sort(), ["mission.xml", "requirements/answers.req", "scenarios/docks.yaml", "sentree.yaml", "skills/Dock.scxml"]);
});
