import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";

import type { Plugin } from "vite";

/** One package that the page contains, as the lock file and its own folder tell. */
export interface Notice {
  name: string;
  version: string;
  license: string;
  text: string;
}

interface LockEntry {
  version?: string;
  dev?: boolean;
  optional?: boolean;
}

/** Names, versions, licences and licence texts of all packages of the lock file that are not only for development. */
export function collect_notices(folder: string): Notice[] {
  const lock = JSON.parse(readFileSync(join(folder, "package-lock.json"), "utf8")) as { packages: Record<string, LockEntry> };
  const found: Notice[] = [];
  for (const [path, entry] of Object.entries(lock.packages)) {
    if (path === "" || entry.dev || entry.optional) continue;
    const at = join(folder, path);
    const manifest = JSON.parse(readFileSync(join(at, "package.json"), "utf8")) as { name: string; license?: string };
    const file = readdirSync(at).find((name) => /^(licen[cs]e|copying)(\.|$)/i.test(name));
    found.push({
      name: manifest.name,
      version: entry.version ?? "",
      license: manifest.license ?? "unknown",
      text: file ? readFileSync(join(at, file), "utf8").trim() : "",
    });
  }
  return found.sort((a, b) => (a.name < b.name ? -1 : 1));
}

export function format_notices(notices: Notice[]): string {
  const parts = notices.map((n) => `${n.name} ${n.version} (${n.license})\n\n${n.text || "The package has no licence text of its own."}`);
  return `Sentree Studio contains these packages.\n\n${parts.join(`\n\n${"-".repeat(80)}\n\n`)}\n`;
}

/** Writes `assets/notices.txt`. */
export function notices(): Plugin {
  return {
    name: "notices",
    apply: "build",
    generateBundle() {
      this.emitFile({ type: "asset", fileName: "assets/notices.txt", source: format_notices(collect_notices(process.cwd())) });
    },
  };
}
