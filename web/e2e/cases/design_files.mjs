// Files of the project are renamed and deleted in its list: what names them follows, or is told; undo brings back each byte.
import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync, rmSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { contents, copy_of, open_design, serve_design, settled, undo_name } from "../harness/design.mjs";
import { run } from "../harness/program.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

test("a file is renamed by key with what names it, and deleted from its menu after its users were told", async () => {
  const folder = copy_of("recharge");
  const original = contents(folder);
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "requirements/recharge.req" });
  await settled(page);
  const row = (file) => page.locator(`.file-row[data-file="${file}"]`);
  // What is on disk is a project whenever a file has gone.
  const whole = async () => {
    await page.getByTestId("save").and(page.locator(":disabled")).waitFor();
    assert.equal((await run(["check", folder])).code, 0);
  };

  // By key; the name alone is chosen, so that one types over it.
  await row("requirements/recharge.req").focus();
  await page.keyboard.press("F2");
  await page.getByLabel("New name of requirements/recharge.req").waitFor();
  await page.keyboard.type("charge");
  await page.keyboard.press("Enter");
  await row("requirements/charge.req").and(page.locator("[aria-current=true]")).waitFor();
  assert.equal(await undo_name(page), "rename requirements/recharge.req to requirements/charge.req");
  assert.ok(!existsSync(join(folder, "requirements/recharge.req")));
  await page.getByText("saved with it: sentree.yaml").waitFor();
  await whole();
  assert.match(readFileSync(join(folder, "sentree.yaml"), "utf8"), /- \{file: requirements\/charge\.req\} {3}# never_empty/);

  // A skill is what its file is called; its leaves follow. Names that are taken or lead out are refused.
  await row("skills/WaitForUser.scxml").click({ button: "right" });
  await page.getByRole("menuitem", { name: "Rename …" }).click();
  const field = page.getByLabel("New name of skills/WaitForUser.scxml");
  for (const [name, why] of [["../WaitForUser.scxml", /leaves find/], ["skills/AtLocation.scxml", /already/], ["skills/Wait.xml", /ends in/]]) {
    await field.fill(name);
    await page.keyboard.press("Enter");
    await page.getByTestId("refused").getByText(why).waitFor();
  }
  await field.fill("skills/AwaitPerson.scxml");
  await page.keyboard.press("Enter");
  await row("skills/AwaitPerson.scxml").waitFor();
  await whole();
  assert.match(readFileSync(join(folder, "mission.xml"), "utf8"), /<AwaitPerson name="WaitForUser"\/>/);

  // Who uses it is told before it goes.
  await row("world/world.yaml").hover();
  await page.getByLabel("More of world/world.yaml").click();
  await page.getByRole("menuitem", { name: "Delete …" }).click();
  const question = page.locator("dialog.confirm");
  await question.getByText("sentree.yaml:3").waitFor();
  if (pictures) await page.screenshot({ path: join(pictures, "delete.png") });
  await page.keyboard.press("Escape");
  await question.waitFor({ state: "detached" });
  assert.ok(existsSync(join(folder, "world/world.yaml")));
  await row("world/world.yaml").focus();
  await page.keyboard.press("Delete");
  await page.getByTestId("confirm").click();
  await row("world/world.yaml").waitFor({ state: "detached" });
  assert.ok(!existsSync(join(folder, "world/world.yaml")));
  await until(async () => /error/.test(await page.getByTestId("problems").textContent()), "what named it is wrong");

  // The project itself stays.
  await row("sentree.yaml").click({ button: "right" });
  assert.equal(await page.getByRole("menuitem", { name: "Delete …" }).getAttribute("aria-disabled"), "true");
  await page.keyboard.press("Escape");

  for (let i = 0; i < 3; i += 1) {
    const before = await undo_name(page);
    await page.keyboard.press("Control+z");
    await until(async () => (await undo_name(page)) !== before, "a step was undone");
  }
  await whole();
  assert.deepEqual(contents(folder), original);
  await close();
  await program.stop();
  rmSync(folder, { recursive: true, force: true });
});
