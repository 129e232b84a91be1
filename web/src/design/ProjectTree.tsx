import { useState } from "react";

import type { DesignFile, FileKind } from "../protocol/types";
import { useCommand } from "../widgets/commands";
import { Icon } from "../widgets/Icon";
import { add_part, open_file, useDesign, type PartKind, kNoFiles } from "./design";
import { show_recording, useMode } from "./mode";

const kGroups: readonly { title: string; kinds: readonly FileKind[]; part: PartKind | null }[] = [
  { title: "Mission", kinds: ["project", "mission"], part: null },
  { title: "Skills", kinds: ["skill"], part: "skill" },
  { title: "Monitors", kinds: ["monitor"], part: "monitor" },
  { title: "Requirements", kinds: ["requirement"], part: "requirement" },
  { title: "Scenarios", kinds: ["scenario"], part: "scenario" },
  { title: "Components", kinds: ["interface", "model"], part: "component" },
  { title: "World and others", kinds: ["world", "other"], part: null },
];

/** The project's files by what they are, with what is wrong and what is not saved. */
export function ProjectTree() {
  const files = useDesign((state) => state.summary?.files ?? kNoFiles);
  const [adding, set_adding] = useState<PartKind | null>(null);
  useCommand(...kGroups.flatMap(({ part }) => (part ? [{ id: `design.add.${part}`, title: `Add a ${part}`, group: "Design", run: () => set_adding(part) }] : [])));
  return (
    <nav className="project-tree scroll" aria-label="Project">
      {kGroups.map(({ title, kinds, part }) => {
        const own = files.filter(({ kind }) => kinds.includes(kind));
        if (own.length === 0 && !part) return null;
        return (
          <section key={title} aria-label={title}>
            <h2>
              {title}
              {part && (
                <button className="icon-button small" aria-label={`Add a ${part}`} title={`Add a ${part}`} onClick={() => set_adding(adding === part ? null : part)}>
                  <Icon name="plus" />
                </button>
              )}
            </h2>
            {part && adding === part && <NewPart part={part} done={() => set_adding(null)} />}
            <ul>
              {own.map((file) => (
                <FileRow key={file.file} {...file} />
              ))}
            </ul>
          </section>
        );
      })}
      <Recordings />
    </nav>
  );
}

/** Runs of the project that were recorded, the newest first. */
function Recordings() {
  const { recordings, on_show, goes_on } = useMode((state) => state.runs);
  if (recordings.length === 0) return null;
  return (
    <section aria-label="Recordings">
      <h2>Recordings</h2>
      <ul>
        {recordings.map((name) => (
          <li key={name}>
            <button className="file-row" aria-current={on_show === name ? "true" : undefined} title={`runs/${name}: show it in all panels`} data-recording={name} onClick={() => void show_recording(name)}>
              <span className="ellipsis">{name.replace(/\.mcap$/, "")}</span>
              {goes_on === name && <span className="file-badge error">●</span>}
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** What a kind of file goes without in the list. A component's interface and model are two files of one name. */
const kEndings: Partial<Record<FileKind, RegExp>> = { skill: /\.scxml$/, monitor: /\.scxml$/, requirement: /\.req$/, scenario: /\.yaml$/ };

const kWithFolder: ReadonlySet<FileKind> = new Set(["project", "mission", "world", "other"]);

function FileRow({ file, kind, dirty, conflict, errors, warnings }: DesignFile) {
  const open = useDesign((state) => state.file === file);
  const name = kWithFolder.has(kind) ? file : (file.split("/").at(-1) ?? file).replace(kEndings[kind] ?? /$^/, "");
  const said = [file, dirty && "not saved", conflict && "changed on disk as well", errors > 0 && `${errors} ${errors === 1 ? "error" : "errors"}`, warnings > 0 && `${warnings} ${warnings === 1 ? "warning" : "warnings"}`].filter(Boolean).join(", ");
  return (
    <li>
      <button className="file-row" aria-current={open ? "true" : undefined} aria-label={said} title={said} data-file={file} data-dirty={dirty} onClick={() => void open_file(file)}>
        <span className="ellipsis">{name}</span>
        {dirty && <span className="dirty" aria-hidden="true" />}
        {conflict && <span className="file-badge error" data-shown="≠" />}
        {errors > 0 ? <span className="file-badge error" data-shown={errors} /> : warnings > 0 && <span className="file-badge warning" data-shown={warnings} />}
      </button>
    </li>
  );
}

function NewPart({ part, done }: { part: PartKind; done(): void }) {
  const [name, set_name] = useState("");
  return (
    <form
      className="new-part"
      onSubmit={(event) => {
        event.preventDefault();
        void add_part(part, name.trim()).then((made) => made && done());
      }}
    >
      <input
        className="field"
        aria-label={`Name of the new ${part}`}
        placeholder={`Name of the ${part}`}
        autoFocus
        spellCheck={false}
        value={name}
        onChange={(event) => set_name(event.target.value)}
        onKeyDown={(event) => event.key === "Escape" && done()}
      />
      <button className="button small primary" disabled={name.trim() === ""}>
        Add
      </button>
    </form>
  );
}
