// Several pages edit one project: each takes back what it did itself.
import assert from "node:assert/strict";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { contents, copy_of, node, open_design, serve_design, undo_name } from "../harness/design.mjs";

const kStation = 'name="AtStation"';
const kKitchen = 'name="AtKitchen"';

/** Types at the end of a line of the text. */
async function type(page, line, words) {
  await page.locator(".cm-line", { hasText: line }).first().click();
  await page.keyboard.press("End");
  await page.keyboard.type(words);
}
const marks = async (page) => ((await page.locator(".cm-content").innerText()).match(/<!--\w+-->/g) ?? []).join(" ");
const shows = (page, wanted) => until(async () => (await marks(page)) === wanted, `the text has ${wanted || "nothing of it"}`);

async function open_page_of(url) {
  const opened = await open_design(url);
  await node(opened.page, "Root").waitFor();
  await opened.page.getByRole("button", { name: "Text", exact: true }).click();
  return opened;
}

test("an undo takes back what its own page did last, or says that another's edit stands on top", async () => {
  const folder = copy_of("recharge");
  const before = contents(folder);
  const program = await serve_design(folder);
  const [one, other] = [await open_page_of(program.url), await open_page_of(program.url)];
  await type(one.page, kStation, "<!--one-->");
  await shows(other.page, "<!--one-->");
  await until(async () => (await undo_name(other.page)) === "", "that is not the other's to undo");
  await type(other.page, kKitchen, "<!--other-->");
  for (const { page } of [one, other]) await shows(page, "<!--one--> <!--other-->");

  // What the other did since stays; and an edit of the other takes nothing from what can be done again.
  await one.page.keyboard.press("Control+z");
  for (const { page } of [one, other]) await shows(page, "<!--other-->");
  await type(other.page, kKitchen, "<!--more-->");
  await shows(one.page, "<!--other--> <!--more-->");
  await one.page.keyboard.press("Control+y");
  for (const { page } of [one, other]) await shows(page, "<!--one--> <!--other--> <!--more-->");

  // In the same line: not under what another has done since.
  await type(one.page, kKitchen, "<!--mine-->");
  await shows(other.page, "<!--one--> <!--other--> <!--more--> <!--mine-->");
  await other.page.locator(".cm-content").press("Control+z");
  await other.page.getByTestId("refused").getByText("another page has done since").waitFor();
  await shows(other.page, "<!--one--> <!--other--> <!--more--> <!--mine-->");

  // A page that was loaded anew is the same one.
  await one.page.reload();
  await until(async () => (await one.page.getByTestId("undo").innerText()) === "Undo 2", "its steps are still its own");
  await one.page.getByTestId("undo").click();
  await shows(other.page, "<!--one--> <!--other--> <!--more-->");
  await until(async () => (await other.page.getByTestId("undo").innerText()) === "Undo 2", "the other has its own");

  // What a page did that is closed is anybody's.
  await one.close();
  await until(async () => (await other.page.getByTestId("undo").innerText()) === "Undo 3", "all of it can be undone");
  for (let left = 3; left > 0; left -= 1) {
    await other.page.getByTestId("undo").click();
    await until(async () => (await other.page.getByTestId("undo").innerText()) === (left > 1 ? `Undo ${left - 1}` : "Undo"), "one is undone");
  }
  await shows(other.page, "");
  await other.page.locator('[data-file="mission.xml"][data-dirty=false]').waitFor();
  assert.deepEqual(contents(folder), before);
  await other.close();
  await program.stop();
});

test("a tab that was duplicated is a page of its own, and undoes nothing of the other", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const one = await open_page_of(program.url);
  await type(one.page, kStation, "<!--one-->");
  await until(async () => (await one.page.getByTestId("undo").innerText()) === "Undo 1", "it is one's own");
  // What the browser keeps of a tab is copied with it.
  const [copy] = await Promise.all([one.page.context().waitForEvent("page"), one.page.evaluate(() => void window.open(window.location.href))]);
  await shows(copy, "<!--one-->");
  const name_of = (page) => page.evaluate(() => window.sessionStorage.getItem("sentree.page"));
  await until(async () => (await name_of(copy)) !== (await name_of(one.page)), "they are called differently");
  await until(async () => (await undo_name(copy)) === "", "that is not the copy's to undo");
  await type(copy, kKitchen, "<!--copy-->");
  await shows(one.page, "<!--one--> <!--copy-->");
  await one.page.locator(".cm-content").press("Control+z");
  for (const page of [one.page, copy]) await shows(page, "<!--copy-->");
  // Each is the same one after it was loaded anew.
  await copy.reload();
  await until(async () => (await copy.getByTestId("undo").innerText()) === "Undo 1", "the copy's step is still its own");
  await one.close();
  await program.stop();
});
