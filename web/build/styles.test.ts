import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";

const kSources = join(process.cwd(), "src");

/** Styles of design mode are loaded when a project is edited, and stay: what they say of a class is said of every view from then on. */
const kOwners: readonly { sheets: readonly string[]; folders: readonly string[] }[] = [
  { sheets: ["design.css", "design_chart.css", "settings.css", "world.css"], folders: ["design"] },
  { sheets: ["compare.css"], folders: ["compare"] },
];

function sources(folder = kSources, below = ""): { path: string; text: string }[] {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = below === "" ? entry.name : `${below}/${entry.name}`;
    if (entry.isDirectory()) return sources(join(folder, entry.name), path);
    return /\.tsx?$/.test(path) && !/\.test\.tsx?$/.test(path) ? [{ path, text: readFileSync(join(folder, entry.name), "utf8") }] : [];
  });
}

/** What stands in className=…, whether it is a text or is put together. */
function class_names(text: string): Set<string> {
  const found = new Set<string>();
  for (const { index } of text.matchAll(/className=/g)) {
    let at = index + "className=".length;
    let end = at + 1;
    if (text[at] === "{") for (let depth = 1; depth > 0 && end < text.length; end += 1) depth += text[end] === "{" ? 1 : text[end] === "}" ? -1 : 0;
    else end = text.indexOf('"', ++at);
    const said = text.slice(at, end);
    const texts = text[at - 1] === '"' ? [said] : [...said.matchAll(/["'`]([^"'`]*)["'`]/g)].map(([, inner]) => inner!);
    for (const word of texts.join(" ").split(/[^\w-]+/)) if (/^[a-z]/.test(word)) found.add(word);
  }
  return found;
}

/** Classes that rules name and nothing else of design mode: the rules hold for every element of the class, and in it. */
function bare_classes(css: string): Set<string> {
  let plain = css.replace(/\/\*[^]*?\*\//g, "");
  while (/\([^()]*\)/.test(plain)) plain = plain.replace(/\([^()]*\)/g, "");
  const selectors = [...plain.matchAll(/([^{}]+)\{/g)].flatMap(([, listed]) => listed!.split(","));
  return new Set(selectors.flatMap((selector) => (/^[^.[#]*\.([\w-]+)[^.[#]*$/.exec(selector)?.[1] ?? [])));
}

it("what is loaded with a view says nothing of the classes of others", () => {
  const all = sources();
  const clashes = kOwners.flatMap(({ sheets, folders }) =>
    sheets.flatMap((sheet) => {
      const bare = bare_classes(readFileSync(join(kSources, "styles", sheet), "utf8"));
      return all
        .filter(({ path }) => !folders.some((folder) => path.startsWith(`${folder}/`)))
        .flatMap(({ path, text }) => [...class_names(text)].filter((name) => bare.has(name)).map((name) => `${sheet}: .${name} is also of ${path}`));
    }),
  );
  expect(clashes).toEqual([]);
});
