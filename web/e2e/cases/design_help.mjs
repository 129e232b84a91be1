// Help while one types; from a run to what is to be edited; texts that are saved by themselves.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { copy_of, node, open_design, select_word, serve_design, settled } from "../harness/design.mjs";

const options = (page) => page.locator(".cm-tooltip-autocomplete li").allInnerTexts();
/** Types until that is offered, and takes it. */
async function complete(page, typed, wanted) {
  await page.keyboard.type(typed);
  await until(async () => (await options(page)).some((option) => option.startsWith(wanted)), `${wanted} is offered`);
  await page.locator(".cm-tooltip-autocomplete li", { hasText: wanted }).first().click();
}
const has_line = (page, text) => until(async () => (await page.locator(".cm-line", { hasText: text }).count()) > 0, `there is a line with ${text}`);

test("what may stand in a text is offered: events, places, words of requirements; and what stands there is explained", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url, { file: "skills/GoToLocation.scxml" });
  await page.getByRole("button", { name: "Text", exact: true }).click();
  await page.locator(".cm-content").waitFor();
  await select_word(page, 'event="error.communication" cond="_event.data.kind === ', "communication");
  await page.keyboard.press("Escape");
  await select_word(page, 'event="halt" target="abandoning"', "halt");
  await complete(page, "navig", "navigation.stopNavigation.reply");
  await has_line(page, 'event="navigation.stopNavigation.reply" target="abandoning"');

  await page.locator('[data-file="mission.xml"]').click();
  await select_word(page, 'name="GoToKitchen"', "kitchen");
  await complete(page, "sta", "station");
  await page.locator('[data-file="requirements/recharge.req"]').click();
  await page.locator(".cm-content").waitFor();
  await page.locator(".cm-content").click();
  await page.keyboard.press("Control+End");
  await page.keyboard.press("Enter");
  await complete(page, "whene", "whenever");

  // What a name means.
  await page.locator('[data-file="skills/GoToLocation.scxml"]').click();
  const sent = page.locator(".cm-line", { hasText: 'event="gotoTargetByLocationName"' }).first();
  await sent.scrollIntoViewIfNeeded();
  const at = await sent.evaluate((element) => {
    const walker = document.createTreeWalker(element, 4) /* texts */;
    for (let text = walker.nextNode(); text; text = walker.nextNode()) {
      const begin = text.data.indexOf("gotoTargetByLocationName");
      if (begin < 0) continue;
      const range = document.createRange();
      range.setStart(text, begin);
      range.setEnd(text, begin + 8);
      const box = range.getBoundingClientRect();
      return { x: box.left + box.width / 2, y: box.top + box.height / 2 };
    }
    return null;
  });
  await page.mouse.move(at.x, at.y - 60);
  await page.mouse.move(at.x, at.y);
  await until(async () => /gotoTargetByLocationName\(.*name/.test(await page.locator(".code-help").innerText().catch(() => "")), "its signature is shown");
  await close();
  await program.stop();
});

test("from a node or state of a run to where it is edited; edits are saved by themselves if one wants it", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await settled(page);
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator("[data-testid=tree] [data-node]", { hasText: "GoToKitchen" }).click({ button: "right" });
  await page.getByRole("menuitem", { name: "Edit it" }).click();
  await page.locator("[data-testid=design-tree] .node.chosen").waitFor();
  assert.equal(await page.locator("[data-testid=design-tree] .node.chosen").getAttribute("data-name"), "GoToKitchen");
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator("[data-testid=tree] [data-node]", { hasText: "GoToKitchen" }).click();
  // All of the chart, not what is at work alone.
  await page.getByTestId("chart").press("0");
  await page.locator('[data-testid=chart] [data-id="stopping"]').click({ button: "right" });
  await page.getByRole("menuitem", { name: "Edit it" }).click();
  await until(async () => (await page.locator("#design-state").inputValue().catch(() => "")) === "stopping", "the state is chosen in its chart");

  await page.keyboard.press("Escape");
  await page.keyboard.press("Control+k");
  await page.keyboard.type("save each edit");
  await page.keyboard.press("Enter");
  await page.locator('[data-file="mission.xml"]').click();
  await node(page, "WaitForUser").click();
  await page.keyboard.press("Delete");
  await until(() => !readFileSync(join(folder, "mission.xml"), "utf8").includes('name="WaitForUser"'), "it is saved");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "nothing is left to save");
  await close();
  await program.stop();
});
