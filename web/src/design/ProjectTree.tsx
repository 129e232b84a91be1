import { useEffect, useRef, useState } from "react";

import type { DesignFile, FileKind } from "../protocol/types";
import { useCommand } from "../widgets/commands";
import { confirm } from "../widgets/Confirm";
import { Icon } from "../widgets/Icon";
import { Menu } from "../widgets/Menu";
import { add_part, held, open_file, remove_file, rename_file, useDesign, uses_of, type PartKind, kNoFiles } from "./design";
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
  const open = useDesign(({ file }) => file);
  const is_held = useDesign(held);
  const [renaming, set_renaming] = useState<string | null>(null);
  const can_go = open !== null && open !== kProject && files.some(({ file }) => file === open);
  useCommand(
    ...(can_go
      ? [
          { id: "design.file.rename", title: `Rename ${open} …`, group: "Design", run: () => set_renaming(open) },
          { id: "design.file.delete", title: `Delete ${open} …`, group: "Design", run: () => void ask_to_remove(open) },
        ]
      : []),
  );
  useCommand(...kGroups.flatMap(({ part }) => (part ? [{ id: `design.add.${part}`, title: `Add a ${part}`, group: "Design", run: () => set_adding(part) }] : [])));
  return (
    <nav className="project-tree scroll" aria-label="Project">
      {kGroups.map(({ title, kinds, part }) => {
        const own = files.filter(({ kind }) => kinds.includes(kind));
        if (own.length === 0 && !part) return null;
        return (
          <div key={title} role="group" aria-label={title}>
            <h2>
              {title}
              {part && (
                <button className="icon-button small" aria-label={`Add a ${part}`} title={is_held ?? `Add a ${part}`} disabled={is_held !== null} onClick={() => set_adding(adding === part ? null : part)}>
                  <Icon name="plus" />
                </button>
              )}
            </h2>
            {part && adding === part && <NewPart part={part} done={() => set_adding(null)} />}
            <ul>
              {own.map((file) => (
                <FileRow key={file.file} of={file} renames={renaming === file.file} rename={set_renaming} />
              ))}
            </ul>
          </div>
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

/** Its name is fixed, and without it there is no project. */
const kProject = "sentree.yaml";
const kProjectStays = "sentree.yaml is the project itself";

/** Uses of a file that are told one by one. */
const kUsesTold = 30;

/** Says who uses the file, and deletes it then. */
async function ask_to_remove(file: string): Promise<void> {
  const uses = await uses_of(file);
  if (uses === null) return;
  const details = uses.slice(0, kUsesTold).map((use) => `${use.file}:${use.line}  ${use.text}`);
  if (uses.length > kUsesTold) details.push(`and ${uses.length - kUsesTold} more`);
  const text = uses.length === 0 ? `Delete ${file}? Nothing in the project names it.` : `Delete ${file}? It is still used in ${uses.length === 1 ? "one place, which will be an error" : `${uses.length} places, which will be errors`}:`;
  confirm({ text, details, yes: "Delete", run: () => void remove_file(file) });
}

interface RowProps {
  of: DesignFile;
  renames: boolean;
  /** Begins to rename a file, or ends that. */
  rename(file: string | null): void;
}

function FileRow({ of: { file, kind, dirty, conflict, errors, warnings }, renames, rename }: RowProps) {
  const open = useDesign((state) => state.file === file);
  const is_held = useDesign(held);
  const [menu, set_menu] = useState<{ x: number; y: number } | null>(null);
  const why_not = file === kProject ? kProjectStays : is_held;
  const name = kWithFolder.has(kind) ? file : (file.split("/").at(-1) ?? file).replace(kEndings[kind] ?? /$^/, "");
  const said = [file, dirty && "not saved", conflict && "changed on disk as well", errors > 0 && `${errors} ${errors === 1 ? "error" : "errors"}`, warnings > 0 && `${warnings} ${warnings === 1 ? "warning" : "warnings"}`].filter(Boolean).join(", ");
  const menu_at = (element: Element) => {
    const { left, bottom } = element.getBoundingClientRect();
    set_menu({ x: left + 12, y: bottom });
  };
  const key = (event: React.KeyboardEvent) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "ContextMenu" || event.key.toLowerCase() === "m") menu_at(event.currentTarget);
    else if (why_not !== null || (event.key !== "F2" && event.key !== "Delete")) return;
    else if (event.key === "F2") rename(file);
    else void ask_to_remove(file);
    event.preventDefault();
    event.stopPropagation();
  };
  if (renames) return <NewName file={file} done={() => rename(null)} />;
  return (
    <li
      className="file-item"
      onContextMenu={(event) => {
        event.preventDefault();
        set_menu({ x: event.clientX, y: event.clientY });
      }}
    >
      <button className="file-row" aria-current={open ? "true" : undefined} aria-label={said} title={said} data-file={file} data-dirty={dirty} onClick={() => void open_file(file)} onKeyDown={key}>
        <span className="ellipsis">{name}</span>
        {dirty && <span className="dirty" aria-hidden="true" />}
        {conflict && <span className="file-badge error" data-shown="≠" />}
        {errors > 0 ? <span className="file-badge error" data-shown={errors} /> : warnings > 0 && <span className="file-badge warning" data-shown={warnings} />}
      </button>
      <button className="icon-button small file-more" aria-label={`More of ${file}`} title="Rename or delete it" aria-haspopup="menu" onClick={(event) => menu_at(event.currentTarget)}>
        <Icon name="more" />
      </button>
      {menu && (
        <Menu
          {...menu}
          close={() => set_menu(null)}
          label={file}
          head={<strong>{file}</strong>}
          // Once the menu has given the focus back.
          entries={[
            { label: "Rename …", hint: "F2", why_not, run: () => setTimeout(() => rename(file)) },
            { label: "Delete …", hint: "Del", why_not, run: () => setTimeout(() => void ask_to_remove(file)) },
          ]}
        />
      )}
    </li>
  );
}

/** The file's path inside the project while it is written anew. */
function NewName({ file, done }: { file: string; done(): void }) {
  const [path, set_path] = useState(file);
  const field = useRef<HTMLInputElement>(null);
  useEffect(() => {
    const [from, to] = [file.lastIndexOf("/") + 1, file.lastIndexOf(".")];
    field.current?.focus();
    field.current?.setSelectionRange(from, to > from ? to : file.length);
  }, [file]);
  const wanted = path.trim();
  return (
    <li>
      <form
        className="new-part"
        onSubmit={(event) => {
          event.preventDefault();
          if (wanted === file) done();
          else void rename_file(file, wanted).then((renamed) => renamed && done());
        }}
      >
        <input
          ref={field}
          className="field"
          aria-label={`New name of ${file}`}
          title="Its path inside the project; what names it follows, and is saved with it"
          spellCheck={false}
          value={path}
          onChange={(event) => set_path(event.target.value)}
          onKeyDown={(event) => event.key === "Escape" && done()}
        />
        <button className="button small primary" disabled={wanted === ""}>
          Rename
        </button>
      </form>
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
