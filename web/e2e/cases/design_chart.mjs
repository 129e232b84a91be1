// A chart is edited by mouse: transitions are chosen, changed and deleted; states nested, made parallel, final and history;
// what they do is written; undone, the file has the same bytes.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { kOwnChart as kChart, carry_state, choose_in_menu, click_transition, floor, place_of_transition, state_at } from "../harness/chart.mjs";
import { copy_of, drag, middle, open_design, serve_design, settled, undo_name } from "../harness/design.mjs";

async function open_chart() {
  const folder = copy_of("recharge");
  const file = join(folder, "skills", "Own.scxml");
  writeFileSync(file, kChart);
  const program = await serve_design(folder);
  const opened = await open_design(program.url, { file: "skills/Own.scxml" });
  await state_at(opened.page, "moving").waitFor();
  // The timeline of the shadow run has come, and the picture has the room that it keeps.
  await settled(opened.page);
  return { program, file, ...opened };
}

/** Nobody answers whether an edit was made but the name of the step that undoes it. */
const did = (page, name) => until(async () => (await undo_name(page)) === name, `${name} was done`);

/** The picture follows an edit a moment later; until then its places are those of before. */
const drawn_in = (page, id, parent) =>
  until(async () => {
    const [inner, outer] = [await state_at(page, id).boundingBox(), await state_at(page, parent).boundingBox()];
    return inner && outer && inner.x > outer.x && inner.y > outer.y && inner.x + inner.width < outer.x + outer.width && inner.y + inner.height < outer.y + outer.height;
  }, `${id} is drawn in ${parent}`);

async function saved(page, file) {
  await page.getByTestId("save").click();
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "it is saved");
  return readFileSync(file, "utf8");
}

async function fill(page, id, text) {
  await page.locator(`#${id}`).fill(text);
  await page.locator(`#${id}`).press("Enter");
}

test("a transition is chosen in the picture, edited, ordered and deleted; undone, every byte is back", async () => {
  const { page, close, program, file } = await open_chart();
  await click_transition(page, "Transition moving tick → idle");
  await until(async () => (await page.locator("#transition-event").inputValue()) === "tick", "its event is a field");
  await fill(page, "transition-event", "error.communication");
  await did(page, "change a transition of moving");
  // It is still the one that is chosen.
  await fill(page, "transition-condition", "_event.data < 3");
  await until(() => place_of_transition(page, "Transition moving error.communication [_event.data < 3] → idle"), "the condition is drawn");
  await fill(page, "transition-target", "trip");
  await until(() => place_of_transition(page, "Transition moving error.communication [_event.data < 3] → trip"), "it leads elsewhere");
  await page.getByRole("button", { name: "Later" }).click();
  await did(page, "order the transitions of moving");
  await page.getByRole("combobox", { name: "What to add: What is done" }).selectOption("raise an event");
  await page.getByRole("button", { name: "Add: What is done" }).click();
  await page.locator("#transition-0").waitFor();
  await fill(page, "transition-0", '<raise event="again"/>');
  await did(page, "change a transition of moving");
  const edited = await saved(page, file);
  assert.match(edited, /<transition event='error.communication' target='trip' cond="_event.data &lt; 3">\n\s+<raise event="again"\/>\n\s+<\/transition>/);
  assert.match(edited, /<!-- stops -->/);
  await page.getByTestId("design-chart").focus();
  await page.keyboard.press("Delete");
  await did(page, "delete a transition of moving");
  await click_transition(page, "Transition moving halt → halted", { button: "right" });
  await choose_in_menu(page, /^Delete/);
  await until(async () => (await page.locator("[data-testid=design-chart] [data-transition]").count()) === 3, "two are gone");
  while ((await undo_name(page)) !== "") {
    const name = await page.getByTestId("undo").innerText();
    await page.getByTestId("undo").click();
    await until(async () => (await page.getByTestId("undo").innerText()) !== name, "undone");
  }
  assert.equal(await saved(page, file), kChart);
  await close();
  await program.stop();
});

test("what a transition waits for is written where it stands in the picture", async () => {
  const { page, close, program, file } = await open_chart();
  const field = page.getByTestId("label-field");
  const open = async (label) => {
    await click_transition(page, label, { clickCount: 2 });
    await field.waitFor();
  };
  await open("Transition moving tick → idle");
  assert.equal(await field.inputValue(), "tick");
  // It is at its label.
  const [at, label] = [await field.boundingBox(), await page.locator('[data-testid=design-chart] [aria-label="Transition moving tick → idle"] .label text').first().boundingBox()];
  assert.ok(Math.abs(at.x - label.x) < 20 && Math.abs(at.y - label.y) < 20);
  await page.keyboard.type("error.communication [count > 2");
  await page.keyboard.press("Enter");
  await page.getByTestId("refused").getByText("write event [condition]").waitFor();
  await page.keyboard.type("]");
  await page.keyboard.press("Enter");
  await did(page, "change a transition of moving");
  await until(() => page.evaluate(() => document.activeElement?.dataset.testid === "design-chart"), "the picture has the keys again");
  await open("Transition moving error.communication [count > 2] → idle");
  await page.keyboard.type("never");
  await page.keyboard.press("Escape");
  await field.waitFor({ state: "detached" });
  assert.match(await saved(page, file), /<transition event='error.communication' target='idle' cond="count &gt; 2"\/> <!-- stops -->/);
  await page.keyboard.press("Control+z");
  await until(() => place_of_transition(page, "Transition moving tick → idle"), "one step takes both back");
  await close();
  await program.stop();
});

test("states are carried into each other and out, and made what they are to be, by mouse", async () => {
  const { page, close, program, file } = await open_chart();
  await carry_state(page, "idle", await middle(state_at(page, "trip").locator(".name").first()));
  await until(async () => (await page.getByTestId("drag-label").innerText()) === "idle → trip", "it says where it goes");
  await page.mouse.up();
  await did(page, "move idle into trip");
  await drawn_in(page, "idle", "trip");
  // A state cannot go into what is inside of it, and says so.
  await state_at(page, "trip").locator(".name").first().click();
  await carry_state(page, "trip", await middle(state_at(page, "out").locator(".name").first()));
  await until(async () => /cannot go into itself/.test(await page.getByTestId("drag-label").innerText()), "it says why not");
  await page.mouse.up();
  await until(async () => (await page.getByTestId("drag-label").count()) === 0, "the drag is over");
  assert.equal(await undo_name(page), "move idle into trip");
  await carry_state(page, "back", await until(() => floor(page), "there is a bare place"));
  await page.mouse.up();
  await did(page, "move back to the top level");

  await state_at(page, "trip").locator(".name").first().click({ button: "right" });
  await page.getByRole("menuitemcheckbox", { name: "The chart begins with it" }).click();
  await did(page, "begin with trip");
  await state_at(page, "back").click({ button: "right" });
  await choose_in_menu(page, "Put it into a new parallel");
  await until(() => page.evaluate(() => document.activeElement?.id === "design-state"), "the id of the new one is asked for");
  await page.keyboard.type("both");
  await page.keyboard.press("Enter");
  await state_at(page, "both").waitFor();
  await state_at(page, "back").click();
  await page.locator("#design-kind").selectOption("parallel");
  await did(page, "make back a parallel");
  await state_at(page, "trip").locator(".name").first().click({ button: "right" });
  await choose_in_menu(page, "Add a deep history inside");
  await until(() => page.evaluate(() => document.activeElement?.id === "design-state"), "its id is asked for");
  await page.keyboard.type("last");
  await page.keyboard.press("Enter");
  await did(page, "rename state1 to last");
  await until(async () => (await state_at(page, "last").locator(".name").textContent()) === "H*", "it is drawn as a deep history");
  await state_at(page, "out").click();
  await page.locator("#design-kind").selectOption("final");
  await did(page, "make out a final");
  await state_at(page, "moving").click();
  await page.getByRole("combobox", { name: "What to add: On entry" }).selectOption("assign");
  await page.getByRole("button", { name: "Add: On entry" }).click();
  await page.locator("#entry-0").waitFor();
  await fill(page, "entry-0", '<log label="moving" expr="1"/>');
  await did(page, "change onentry of moving");
  // From its edge to the ground: to a state that is made there.
  const draw_to_ground = async () => {
    const { box } = await middle(state_at(page, "moving").locator("rect").first());
    await drag(page, { x: box.x + 2, y: box.y + box.height / 2 }, await until(() => floor(page), "there is a bare place"));
    await page.mouse.up();
    await until(() => page.evaluate(() => document.activeElement?.id === "design-event"), "the event is asked for");
    await page.keyboard.type("lost");
  };
  // Escape takes all of it back: there is neither a transition nor a state.
  const steps = await page.getByTestId("undo").innerText();
  await draw_to_ground();
  await page.keyboard.press("Escape");
  await until(() => page.evaluate(() => document.activeElement?.dataset.testid === "design-chart"), "the picture has the keys again");
  assert.equal(await page.locator("#design-event").inputValue(), "");
  assert.equal(await page.locator("#design-target-id").count(), 0);
  assert.equal(await page.getByTestId("undo").innerText(), steps);
  assert.equal(await state_at(page, "state1").count(), 0);
  await draw_to_ground();
  await page.locator("#design-target-id").fill("astray");
  await page.keyboard.press("Enter");
  await did(page, "add transition from moving to new state astray");
  const text = await saved(page, file);
  assert.match(text, /<scxml [^>]*initial="trip">\n {2}<!-- on the way -->\n/);
  assert.match(text, /<state id="moving" xmlns:qt="http:\/\/www.qt.io" qt:editorinfo="geometry:1;2">\n {4}<onentry>\n {6}<log label="moving" expr="1"\/>\n {4}<\/onentry>\n {4}<transition event='tick' target='idle'\/> <!-- stops -->\n {4}<transition event="halt" target="halted"\/>\n {4}<transition event="lost" target="astray"\/>\n/);
  assert.match(text, /<final id="out"\/>\n {4}<state id="idle"><transition event="go" target="moving"\/><\/state>\n {4}<history id="last" type="deep"><transition target="out"\/><\/history>\n {2}<\/state>/);
  assert.match(text, /<parallel id="both">\n {4}<parallel id="back"\/>\n {2}<\/parallel>/);
  await close();
  await program.stop();
});

test("Escape in the name of a state that was just made takes it back, and later does not", async () => {
  const { page, close, program, file } = await open_chart();
  const focused = (id) => until(() => page.evaluate((wanted) => (document.activeElement?.id || document.activeElement?.dataset.testid) === wanted, id), `${id} has the keys`);
  const make = async () => {
    const { x, y } = await until(() => floor(page), "there is a bare place");
    await page.mouse.dblclick(x, y);
    await did(page, "add state state1");
    await focused("design-state");
  };
  for (const typed of ["", "astray"]) {
    await make();
    await page.keyboard.type(typed);
    await page.keyboard.press("Escape");
    await did(page, "");
    await focused("design-chart");
    await until(async () => (await state_at(page, "state1").count()) === 0, "it is gone");
    assert.equal(await page.locator("[data-dirty=true]").count(), 0);
  }
  // A field that was left is as any other.
  await make();
  await page.keyboard.press("Tab");
  await page.locator("#design-state").focus();
  await page.keyboard.press("Escape");
  await page.locator("#design-state").fill("kept");
  await page.keyboard.press("Enter");
  await did(page, "rename state1 to kept");
  assert.match(await saved(page, file), /<state id="kept"\/>/);
  await close();
  await program.stop();
});

test("by keyboard alone a chart is gone through and edited", async () => {
  const { page, close, program } = await open_chart();
  await page.getByTestId("design-chart").focus();
  await page.keyboard.press("s");
  await until(async () => (await page.locator("#design-state").inputValue()) === "moving", "the first state is chosen");
  await page.keyboard.press("t");
  await until(async () => (await page.locator("#transition-event").inputValue()) === "tick", "its first transition is");
  await page.keyboard.press("t");
  await until(async () => (await page.locator("#transition-event").inputValue()) === "halt", "and its second");
  await page.keyboard.press("Shift+T");
  await until(async () => (await page.locator("#transition-event").inputValue()) === "tick", "and the first again");
  await page.keyboard.press("F2");
  await until(() => page.evaluate(() => document.activeElement?.id === "transition-event"), "F2 goes to its event");
  await page.keyboard.type("tock");
  await page.keyboard.press("Enter");
  await did(page, "change a transition of moving");
  await page.getByTestId("design-chart").focus();
  await page.keyboard.press("Escape");
  for (let i = 0; i < 3; i++) await page.keyboard.press("s");
  await until(async () => (await page.locator("#design-state").inputValue()) === "trip", "the third state is chosen");
  await page.keyboard.press("m");
  await page.getByRole("menu").waitFor();
  assert.equal(await page.evaluate(() => document.activeElement?.textContent?.startsWith("Rename")), true);
  await page.keyboard.press("Escape");
  await page.getByTestId("design-chart").focus();
  await page.keyboard.press("Delete");
  await did(page, "delete state trip");
  await close();
  await program.stop();
});

test("what is done in a chart's form leaves the focus in the picture, and Ctrl+K gives it back", async () => {
  const { page, close, program } = await open_chart();
  const has_focus = (what) => until(() => page.evaluate((wanted) => (document.activeElement?.id || document.activeElement?.dataset.testid || document.activeElement?.getAttribute("aria-label")) === wanted, what), `${what} has the focus`);
  await state_at(page, "idle").click();
  await has_focus("design-chart");
  await page.keyboard.press("F2");
  await has_focus("design-state");
  await page.keyboard.type("still");
  await page.keyboard.press("Enter");
  await did(page, "rename idle to still");
  await has_focus("design-chart");
  // The next keys are of what was renamed.
  await page.keyboard.press("n");
  await has_focus("design-event");
  await page.keyboard.type("wake");
  await page.keyboard.press("Enter");
  await until(async () => /transition/.test(await undo_name(page)), "a transition was added");
  await has_focus("design-chart");
  await page.locator("#design-new-state").fill("fresh");
  await page.locator("#design-new-state").press("Enter");
  await state_at(page, "fresh").waitFor();
  await has_focus("design-chart");
  await page.keyboard.press("Delete");
  await until(async () => (await state_at(page, "fresh").count()) === 0, "it is the chosen one");

  for (const from of [page.getByTestId("design-chart"), page.locator(".cm-content")]) {
    await from.focus();
    const before = await page.evaluate(() => document.activeElement.getAttribute("class"));
    await page.keyboard.press("Control+k");
    await has_focus("Find");
    await page.keyboard.type("xyz");
    await page.keyboard.press("Escape");
    await until(async () => (await page.evaluate(() => document.activeElement.getAttribute("class"))) === before, "the focus is back");
  }
  // A command has it where it is about something.
  await page.keyboard.press("Control+k");
  await has_focus("Find");
  await page.keyboard.type("open mission.xml");
  await page.keyboard.press("Enter");
  await page.getByTestId("design-tree").waitFor();
  await page.keyboard.press("Control+k");
  await page.keyboard.type("go to the tree");
  await page.keyboard.press("Enter");
  await has_focus("design-tree");
  await close();
  await program.stop();
});

/** From now on answers to gestures, and what comes behind them, wait until `release`. */
async function hold_answers(page) {
  const gestures = new Set();
  const waiting = [];
  let release = null;
  await page.routeWebSocket(/\/api\/ws$/, (socket) => {
    const server = socket.connectToServer();
    socket.onMessage((message) => {
      const { op, id } = JSON.parse(message);
      if (op === "design_gesture" || op === "design_rename") gestures.add(id);
      server.send(message);
    });
    server.onMessage((message) => {
      const { type, id } = JSON.parse(message);
      if (waiting.length > 0 || (type === "answer" && gestures.has(id))) waiting.push(message);
      else socket.send(message);
      release = () => waiting.splice(0).forEach((each) => socket.send(each));
    });
  });
  await page.reload();
  return { answered: () => waiting.length > 0, release: () => release() };
}

test("who chooses something else while an edit is on its way keeps that; picture and choice change at once", async () => {
  const { page, close, program } = await open_chart();
  const { answered, release } = await hold_answers(page);
  await page.locator('.file-row[data-file="skills/Own.scxml"]').click();
  await state_at(page, "idle").click();
  await page.locator("#design-state").fill("still");
  await page.locator("#design-state").press("Enter");
  await until(answered, "the program has done it");
  assert.deepEqual([await undo_name(page), await state_at(page, "still").count()], ["", 0]);
  await state_at(page, "trip").locator(".name").first().click();
  await until(async () => (await page.locator("#design-state").inputValue()) === "trip", "another is chosen");
  release();
  await did(page, "rename idle to still");
  await state_at(page, "still").waitFor();
  assert.equal(await page.locator("#design-state").inputValue(), "trip");
  // Who waits has what was made.
  await state_at(page, "still").click();
  await page.locator("#design-state").fill("calm");
  await page.locator("#design-state").press("Enter");
  await until(answered, "the program has done it");
  release();
  await did(page, "rename still to calm");
  assert.equal(await page.locator("#design-state").inputValue(), "calm");
  await close();
  await program.stop();
});

test("renaming a state says what may mean it and cannot be told", async () => {
  const { page, close, program, file } = await open_chart();
  writeFileSync(file, kChart.replace('<transition event="halt"', '<transition event="halt" cond="In(_event.data.where)"'));
  await state_at(page, "idle").click();
  await until(async () => (await page.locator("#design-state").inputValue()) === "idle", "it is chosen");
  await fill(page, "design-state", "still");
  await did(page, "rename idle to still");
  await page.getByTestId("refused").getByText("look at what may mean idle and stays as it is, for that cannot be told: skills/Own.scxml:5 In(…) of an expression").waitFor();
  await close();
  await program.stop();
});
