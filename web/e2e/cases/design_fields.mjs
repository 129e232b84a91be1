// Fields beside a picture: what they refuse is seen, and nothing that is typed in them is lost.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { copy_of, drag, node, open_design, serve_design, settled, undo_name } from "../harness/design.mjs";

const kSkill = "skills/BatteryLevelAbove-buggy.scxml";

/** Whether all of an element is to be seen; clicks may go through it. */
const is_seen = (locator) =>
  locator.evaluate((element) => {
    const { left, right, top, bottom } = element.getBoundingClientRect();
    const hit = (x, y) => element.contains(document.elementFromPoint(x, y));
    element.style.pointerEvents = "auto";
    const seen = right - left > 100 && hit(left + 2, (top + bottom) / 2) && hit(right - 2, (top + bottom) / 2);
    element.style.pointerEvents = "";
    return seen;
  });

for (const [width, height] of [[1440, 900], [1366, 768], [1024, 700]]) test(`why something is refused is to be seen, at ${width}×${height}`, async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url, { width, height, file: kSkill });
  await page.locator("[data-testid=design-chart] [data-id=asking] .name").first().click();
  await page.getByTestId("design-chart").press("t");
  await page.locator("#transition-target").fill("nowhere");
  await page.keyboard.press("Enter");
  await page.getByText("there is no state").waitFor();
  assert.ok(await is_seen(page.getByTestId("refused")));
  await page.getByRole("button", { name: "Put away why it was refused" }).click();
  await until(async () => (await page.getByTestId("refused").count()) === 0, "it is put away");
  await close();
  await program.stop();
});

test("what is typed in a field is taken back by itself, and told before files are saved", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "AtKitchen").click();
  await page.keyboard.press("F2");
  await page.locator("#design-name").fill("InKitchen");
  await page.keyboard.press("Enter");
  await node(page, "InKitchen").waitFor();
  await settled(page);
  const field = page.locator("#design-name");
  await field.focus();
  await page.keyboard.press("End");
  await page.keyboard.type("Now");
  await page.keyboard.press("Control+z");
  await until(async () => (await field.inputValue()) === "InKitchen", "the field is as it was");
  assert.match(await undo_name(page), /InKitchen/);
  await page.keyboard.press("Control+z");
  await node(page, "AtKitchen").waitFor();

  await field.focus();
  await page.keyboard.press("End");
  await page.keyboard.type("Now");
  await page.keyboard.press("Control+s");
  await until(() => readFileSync(join(folder, "mission.xml"), "utf8").includes('name="AtKitchenNow"'), "it is saved");
  await page.locator('[data-file="mission.xml"][data-dirty=false]').waitFor();
  await close();
  await program.stop();
});

test("a port or condition that is added is written next; what is no name of one is told", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url);
  await node(page, "WaitForUser").click();
  await page.locator("#design-add").fill("n := n +");
  await page.locator("#design-add").press("Enter");
  await page.getByRole("alert").filter({ hasText: "“n := n +” is no name of a port or condition" }).waitFor();
  await page.locator("#design-add").fill("_onSuccess");
  await page.locator("#design-add").press("Enter");
  await until(async () => (await page.evaluate(() => document.activeElement?.id)) === "design-port-_onSuccess", "its field has the focus");
  assert.equal(await page.locator("#design-add").inputValue(), "");
  await page.keyboard.type("n := n +");
  await page.keyboard.press("Enter");
  await page.getByTestId("inspector").locator(".inspector-finding").filter({ hasText: /_onSuccess|script|n := n/ }).first().waitFor();
  // One that is there is gone to, and keeps what it says.
  await page.locator("#design-add").fill("_onSuccess");
  await page.locator("#design-add").press("Enter");
  await until(async () => (await page.evaluate(() => document.activeElement?.id)) === "design-port-_onSuccess", "its field has the focus again");
  assert.equal(await page.locator("#design-port-_onSuccess").inputValue(), "n := n +");
  await close();
  await program.stop();
});

test("a condition that is long is to be seen as a whole", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url, { file: kSkill });
  await page.locator("[data-testid=design-chart] [data-id=asking] .name").first().click();
  await page.getByTestId("design-chart").press("t");
  const field = page.locator("#transition-condition");
  const fits = () => field.evaluate((element) => element.scrollWidth <= element.clientWidth + 1 && element.scrollHeight <= element.clientHeight + 1);
  await until(fits, "the condition fits");
  await field.fill("threshold");
  await page.keyboard.press("Enter");
  await until(async () => (await field.evaluate((element) => element.tagName)) === "INPUT", "it is a line");
  assert.equal(await page.evaluate(() => document.activeElement.id), "transition-condition");
  // Who has gone elsewhere stays there, also where it becomes several lines.
  await page.keyboard.press("Enter");
  await page.getByTestId("undo").click();
  await until(async () => (await field.evaluate((element) => element.tagName)) === "TEXTAREA", "it is several lines");
  assert.notEqual(await page.evaluate(() => document.activeElement.id), "transition-condition");
  await close();
  await program.stop();
});

test("definitions and conditions of requirements are to be seen as a whole, and told by Enter", async () => {
  const program = await serve_design(copy_of("recharge"));
  for (const [width, height] of [[1440, 900], [1366, 768], [1024, 700]]) {
    const { page, close } = await open_design(program.url, { width, height, file: "requirements/recharge.req" });
    const fields = page.locator("[data-testid=requirement-blocks] textarea");
    await fields.first().waitFor();
    assert.ok((await fields.count()) > 3);
    const cut = () => fields.evaluateAll((all) => all.filter((one) => one.scrollWidth > one.clientWidth + 1 || one.scrollHeight > one.clientHeight + 1).map((one) => one.value));
    await until(async () => (await cut()).length === 0, "nothing is cut off");
    // Also where the picture is made narrower.
    const border = page.getByRole("separator", { name: "Width of the picture" });
    if ((await border.count()) > 0) {
      const { width: before } = await page.getByTestId("picture-view").boundingBox();
      await border.press("Shift+ArrowLeft");
      await until(async () => (await page.getByTestId("picture-view").boundingBox()).width < before - 40, "the picture is narrower");
      await until(async () => (await cut()).length === 0, "nothing is cut off");
      await border.press("Home");
      await until(async () => Math.abs((await page.getByTestId("picture-view").boundingBox()).width - before) < 2, "it is as wide as before");
    }
    await close();
  }
  const { page, close } = await open_design(program.url, { file: "requirements/recharge.req" });
  const field = page.locator('[data-definition="destination"] textarea');
  await field.fill("request(navigation.gotoTargetByLocationName).name + ''");
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)) === "define destination", "it is told");
  await close();
  await program.stop();
});

test("the border between picture and text is moved, by mouse too, and stays where it is", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url);
  await node(page, "Root").waitFor();
  // The timeline below takes its room once there is a run.
  await settled(page);
  const height = async () => (await page.getByTestId("picture-view").boundingBox()).height;
  const before = await height();
  const border = page.getByRole("separator", { name: "Height of the picture" });
  const box = await border.boundingBox();
  await drag(page, { x: box.x + 200, y: box.y + 2 }, { x: box.x + 200, y: box.y - 78 });
  await page.mouse.up();
  await until(async () => Math.abs((await height()) - before + 80) < 3, "the picture is lower");
  await page.reload();
  await node(page, "Root").waitFor();
  await until(async () => Math.abs((await height()) - before + 80) < 3, "and so it is again");
  await border.dblclick();
  await until(async () => Math.abs((await height()) - before) < 3, "it has what fits");
  await close();
  await program.stop();
});
