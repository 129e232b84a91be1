// Who may edit, what may be edited, and what a saved file is after the program was killed.
import assert from "node:assert/strict";
import { readFileSync, rmSync, symlinkSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { state_at } from "../harness/chart.mjs";
import { contents, copy_of, node, open_design, serve_design } from "../harness/design.mjs";
import { operate, until } from "../harness/browser.mjs";

test("each file is old or new, whenever the program is killed while it saves", async () => {
  const folder = copy_of("recharge");
  const file = join(folder, "mission.xml");
  const tail = readFileSync(file, "utf8");
  const whole = (text) => /^(?:<!--\d*-->)?/.exec(text) !== null && text.replace(/^<!--(\d*)-->/, "") === tail;
  for (let round = 0; round < 4; round += 1) {
    const program = await serve_design(folder);
    const { page, close } = await open_design(program.url);
    // A hundred saves, as fast as they are answered; nobody waits for the end of them.
    await page.evaluate(() => {
      const socket = new WebSocket(`ws://${location.host}/api/ws`);
      let id = 1;
      let file = null;
      const send = (op, args) => socket.send(JSON.stringify({ op, id: (id += 1), ...args }));
      window.saves = 0;
      socket.onopen = () => send("design_read", { file: "mission.xml" });
      socket.onmessage = (event) => {
        const message = JSON.parse(event.data);
        if (message.type !== "answer") return;
        if (!message.ok) return;
        if (message.value.text !== undefined) file = message.value;
        if (message.value.saved !== undefined) window.saves += 1;
        if (window.saves >= 100) return;
        if (message.value.version !== undefined && message.value.text === undefined) {
          send("design_save", {});
          return;
        }
        if (message.value.saved !== undefined) {
          send("design_read", { file: "mission.xml" });
          return;
        }
        const mark = /^<!--\d*-->/.exec(file.text)?.[0] ?? "";
        send("design_edit", { file: "mission.xml", base: file.version, cause: "count", edits: [{ from: 0, to: mark.length, text: `<!--${window.saves}${"1".repeat(window.saves)}-->` }] });
      };
    });
    const enough = [1, 7, 23, 41][round];
    await until(() => page.evaluate((count) => window.saves >= count, enough), "some are saved");
    await program.stop("SIGKILL");
    assert.ok(whole(readFileSync(file, "utf8")), "the file is whole");
    await close();
    rmSync(join(folder, ".sentree"), { recursive: true, force: true });
  }
});

test("no page edits without the token, none reaches out of the project", async () => {
  const folder = copy_of("recharge");
  symlinkSync("/etc/hostname", join(folder, "skills/Link.scxml"));
  const program = await serve_design(folder, ["--at", "127.0.0.1:0"]);
  const { page, close } = await open_design(program.url);
  for (const file of ["../mission.xml", "/etc/hostname", "skills/Link.scxml", "skills/../../x.yaml", ".sentree/journal"]) {
    await assert.rejects(operate(page, "design_read", { file }), /no file of this project/);
    await assert.rejects(operate(page, "design_edit", { file, base: 1, cause: "x", edits: [] }), /no file of this project/);
  }
  await assert.rejects(operate(page, "design_add", { kind: "skill", name: "../../x" }), /is no name/);
  // One program at a time edits a project.
  const second = await serve_design(folder, ["--at", "127.0.0.1:0"]);
  const shown = await open_design(second.url);
  await shown.page.getByTestId("standing").getByText(new URL(program.url).host).waitFor();
  // Each gesture says so, too.
  await node(shown.page, "GoToKitchen").click({ button: "right" });
  const item = shown.page.getByRole("menuitem", { name: "Delete GoToKitchen" });
  assert.equal(await item.getAttribute("aria-disabled"), "true");
  assert.match(await item.getAttribute("title"), /edits this project/);
  await shown.page.keyboard.press("Escape");
  // Fields and buttons that would edit show what is there, and why they do nothing; what runs something needs no edit.
  const only_shown = async (...wanted) => {
    for (const one of wanted) {
      await one.and(shown.page.locator(":disabled")).waitFor();
      assert.match(await one.evaluate((element) => element.closest("[title]").title), /edits this project/);
    }
  };
  const before = contents(folder);
  await node(shown.page, "GoToKitchen").click();
  await only_shown(shown.page.locator("#design-port-destination"), shown.page.locator("#design-add"), shown.page.getByRole("button", { name: "Add a skill" }));
  await shown.page.getByTestId("design-tree").press("F2");
  await shown.page.getByTestId("refused").getByText("edits this project").waitFor();
  await shown.page.getByTestId("simulate-button").click();
  await shown.page.getByTestId("simulate").getByRole("button", { name: "Tick" }).click();
  await until(async () => /after 2 ticks/.test(await shown.page.getByTestId("simulate").innerText()), "a tree is run by hand");
  await shown.page.getByTestId("simulate-button").click();
  await shown.page.getByRole("button", { name: "Open its chart" }).click();
  await state_at(shown.page, "starting").click();
  await only_shown(shown.page.locator("#design-state"), shown.page.locator("#design-event"), shown.page.locator("#design-new-state"));
  await shown.page.locator('[data-file="world/world.yaml"]').click();
  await only_shown(shown.page.getByRole("button", { name: "Delete location kitchen" }));
  await shown.page.locator('[data-file="scenarios/experiment1.yaml"]').click();
  await only_shown(shown.page.getByLabel("duration"));
  await shown.page.getByTestId("run-scenario").click();
  await until(async () => (await operate(shown.page, "design")).scenario === "experiment1", "another scenario runs");
  await shown.page.locator('[data-file="sentree.yaml"]').click();
  await only_shown(shown.page.getByRole("button", { name: "Delete service battery" }));
  assert.deepEqual(contents(folder), before);
  const { version } = await operate(page, "design_read", { file: "mission.xml" });
  const edit = { file: "mission.xml", base: version, cause: "x", edits: [{ from: 0, to: 0, text: "<!--first-->" }] };
  await assert.rejects(operate(shown.page, "design_edit", edit), /edits this project/);
  await operate(page, "design_edit", edit);
  await close();
  await program.stop();
  // With what the first has left, though nobody does anything.
  await shown.page.getByTestId("standing").waitFor({ state: "detached" });
  assert.match((await operate(shown.page, "design_read", { file: "mission.xml" })).text, /^<!--first-->/);
  await operate(shown.page, "design_undo", {});
  await shown.close();
  await second.stop();

  const open = await serve_design(folder, ["--at", "0.0.0.0:0", "--insecure"]);
  const with_token = new URL(open.url);
  const local = `http://127.0.0.1:${with_token.port}/`;
  const other = await open_design(`${local}${with_token.hash}`);
  for (const [op, args] of [["design_edit", { file: "mission.xml", base: 1, cause: "x", edits: [] }], ["design_save", {}], ["design_read", { file: "mission.xml" }], ["design_undo", {}]])
    await assert.rejects(operate(other.page, op, args), /token/);
  await other.close();
  // Without it one is told so, and may look at the run.
  const looks = await open_design(local, { may_edit: false });
  await looks.page.getByTestId("only-looks").waitFor();
  assert.equal(await looks.page.getByRole("button", { name: "Record a run of the scenario" }).count(), 0);
  await looks.page.getByRole("button", { name: "Look at its run" }).click();
  await looks.page.getByTestId("tree").waitFor();
  await looks.close();
  await open.stop();
});
