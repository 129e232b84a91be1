// For people without a mouse, without sight of color, with a small window.
import assert from "node:assert/strict";
import { test } from "node:test";

import { open_page, operate, text, until } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

/** Roles of what is worked with: a person who hears the page has nothing but their names. */
const kControls = new Set(["button", "link", "textbox", "searchbox", "combobox", "slider", "spinbutton", "checkbox", "switch", "tab", "menuitem", "menuitemcheckbox", "listbox", "tree", "treeitem", "option", "separator", "application", "image"]);

/** Controls of the accessibility tree without a name, with the element that they are of. */
async function nameless(page) {
  const session = await page.context().newCDPSession(page);
  const { nodes } = await session.send("Accessibility.getFullAXTree");
  const controls = nodes.filter((node) => !node.ignored && kControls.has(node.role?.value));
  const found = [];
  for (const node of controls) {
    if (node.name?.value?.trim()) continue;
    const { outerHTML } = await session.send("DOM.getOuterHTML", { backendNodeId: node.backendDOMNodeId });
    found.push(`${node.role.value}: ${outerHTML.slice(0, 200)}`);
  }
  await session.detach();
  return { controls: controls.length, found };
}

const violated = () => serve_run(example("recharge"), { scenario: "experiment1", args: ["--clock", "virtual", "--factor", "1000"] });

test("everything that can be worked with has a name", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await page.getByTestId("battery-robot").fill("10");
  await page.getByTestId("violation-banner").waitFor();
  // A dialog hides what is behind it.
  const check = async (where, least = 40) => {
    const { controls, found } = await nameless(page);
    assert.ok(controls >= least, `${controls} controls`);
    assert.deepEqual(found, [], where);
  };
  for (const tab of ["Faults", "Parts", "Call", "Standing", "Save"]) {
    await page.getByRole("tab", { name: tab }).click();
    await check(`Steer: ${tab}`);
  }
  await page.keyboard.press("?");
  await page.getByRole("dialog").waitFor();
  await check("help", 1);
  await page.keyboard.press("Escape");
  await page.keyboard.press("Control+k");
  await page.getByRole("combobox", { name: /./ }).first().waitFor();
  await check("palette", 2);
  await close();
  await program.stop();
});

test("what is found is listed once, whatever was typed before", async () => {
  const program = await violated();
  const { page, close } = await open_page(program.url);
  await page.getByTestId("violation-banner").waitFor();
  await page.keyboard.press("Control+k");
  const rows = () => page.locator("#palette-list [role=option]").evaluateAll((all) => all.map(({ textContent }) => textContent));
  for (const typed of ["goto", "gotok", "gotos", "chart gotok"]) {
    await page.getByRole("combobox", { name: "Find" }).fill(typed);
    const letters = typed.split(" ");
    await until(async () => (await rows()).every((row) => letters.every((word) => row.toLowerCase().includes(word))), `nothing but ${typed} is listed`);
    const listed = await rows();
    assert.ok(listed.length > 0);
    assert.deepEqual(listed, [...new Set(listed)], `${typed}: each once`);
  }
  await page.keyboard.press("Enter");
  await page.locator("[data-testid=chart][data-chart*=GoToKitchen]").waitFor();
  await close();
  await program.stop();
});

test("the Tab key reaches every control that can be pressed, each shown where it is", async () => {
  // Paused, so that no control comes or goes meanwhile; those that steer are among them.
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await operate(page, "intervene", { call: "simulation.setBatteryCharge", args: { percent: 10 } });
  await page.getByTestId("violation-banner").waitFor();
  await operate(page, "pause");
  await until(async () => /Paused/.test(await text(page, "presence")), "the run is paused");
  const wanted = await page.evaluate(() => {
    const shown = (element) => element.checkVisibility() && !element.matches(":disabled, fieldset:disabled *") && element.tabIndex >= 0;
    const controls = [...document.querySelectorAll("button, input, select, textarea, [tabindex='0']")].filter(shown);
    controls.forEach((control, i) => (control.dataset.order = String(i)));
    return controls.length;
  });
  assert.ok(wanted > 25);
  const reached = new Set();
  let unmarked = null;
  for (let i = 0; i <= wanted + 10; i++) {
    await page.keyboard.press("Tab");
    const at = await page.evaluate(() => {
      const { activeElement } = document;
      const style = getComputedStyle(activeElement);
      const marked = style.outlineStyle !== "none" || style.boxShadow !== "none" || getComputedStyle(activeElement, "::after").content !== "none";
      return { order: activeElement.dataset.order ?? null, marked, what: activeElement.outerHTML.slice(0, 120) };
    });
    if (at.order === null) continue;
    reached.add(at.order);
    if (!at.marked) unmarked ??= at.what;
  }
  const missed = await page.evaluate((orders) => [...document.querySelectorAll("[data-order]")].filter((element) => !orders.includes(element.dataset.order)).map((element) => element.outerHTML.slice(0, 120)), [...reached]);
  assert.deepEqual(missed, []);
  assert.equal(unmarked, null, "the focus can be seen");
  await close();
  await program.stop();
});

for (const theme of ["light", "dark"]) {
  test(`a window of 800 pixels shows every panel, none above another, ${theme}`, async () => {
    const program = await violated();
    const { page, close } = await open_page(program.url, { theme, width: 800, height: 900 });
    await page.getByTestId("violation-banner").waitFor();
    const boxes = await page.locator(".panel").evaluateAll((panels) =>
      panels.filter((panel) => panel.checkVisibility()).map((panel) => {
        const { left, right, top, bottom } = panel.getBoundingClientRect();
        return { id: panel.id, left, right, top, bottom };
      }),
    );
    assert.equal(boxes.length, 4, "mission, chart, map and timeline");
    for (const box of boxes) {
      assert.ok(box.bottom - box.top >= 250 && box.left >= 0 && box.right <= 800, JSON.stringify(box));
      for (const other of boxes) {
        if (other.id < box.id) assert.ok(other.bottom <= box.top || box.bottom <= other.top, `${other.id} and ${box.id} overlap`);
      }
    }
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= 800), "nothing is wider than the window");
    // A key goes to a panel that is further down.
    await page.locator("#panel-timeline").scrollIntoViewIfNeeded();
    await page.locator("#panel-map").evaluate((panel) => panel.focus());
    await until(() => page.locator("#panel-map").evaluate((panel) => panel.getBoundingClientRect().top < innerHeight), "the map is in sight");
    await close();
    await program.stop();
  });
}

test("colours follow the system until one chooses others, and again when one has chosen the system's", async () => {
  const program = await serve_run(example("recharge"), { scenario: "experiment1" });
  const { page, close } = await open_page(program.url, { theme: "dark" });
  const colours = async () => [await page.locator("html").getAttribute("data-theme"), await page.locator("body").evaluate((body) => getComputedStyle(body).colorScheme)];
  const are = (theme) => until(async () => (await colours()).join() === `${theme},${theme}`, `colours are ${theme}`);
  await are("dark");
  await page.emulateMedia({ colorScheme: "light" });
  await are("light");
  await page.getByRole("button", { name: "Dark", exact: true }).click();
  await are("dark");
  await page.emulateMedia({ colorScheme: "dark" });
  await page.emulateMedia({ colorScheme: "light" });
  await are("dark");
  await page.getByRole("button", { name: "Light", exact: true }).click();
  await are("light");
  await page.emulateMedia({ colorScheme: "dark" });
  await are("dark");
  await close();
  await program.stop();
});
