import { expect, it } from "vitest";

import { collect_notices, format_notices } from "./notices";

it("every package of the page is named with the text of its licence", () => {
  const notices = collect_notices(process.cwd());
  expect(notices.map((notice) => notice.name)).toEqual(expect.arrayContaining(["react", "react-dom", "zustand"]));
  for (const notice of notices) expect(notice.text, `${notice.name} has no licence text`).not.toBe("");
  expect(notices.map((notice) => notice.name)).not.toContain("vite");
  expect(format_notices(notices)).toContain("react-dom 19");
});
