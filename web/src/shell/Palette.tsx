import { useMemo, useState } from "react";
import { create } from "zustand";

import { useEdit } from "../store/edit";
import { select, useStudio } from "../store/store";
import { useMode } from "../design/mode";
import { open_chart } from "../panels/charts/charts";
import { useCommand, useCommands } from "../widgets/commands";
import { Dialog } from "../widgets/Dialog";
import { go_to_panel } from "../widgets/layout";
import { matches } from "../widgets/match";

const usePalette = create<{ open: boolean }>()(() => ({ open: false }));
export const open_palette = () => usePalette.setState({ open: true });
const close = () => usePalette.setState({ open: false });

export const kEntriesShownMax = 60;

interface Entry {
  id: string;
  title: string;
  group: string;
  keys?: readonly string[] | undefined;
  run(): void;
}

/** A panel of the run, also from the files of a project that is edited. */
export function go_to(panel: Parameters<typeof go_to_panel>[0]): void {
  useMode.setState({ mode: "run" });
  // Not before its panels are there.
  setTimeout(() => go_to_panel(panel));
}

/** Whether the project's files are on show. What is found then is shown in them. */
export function useDesigns(): boolean {
  const is_design = useStudio((studio) => studio.hello?.design ?? false);
  return useMode(({ mode }) => mode === "design") && is_design;
}

function useEntries(): Entry[] {
  const commands = useCommands((all) => all.commands);
  const index = useStudio((studio) => studio.index);
  const designs = useDesigns();
  return useMemo(() => {
    const entries: Entry[] = [...commands.values()].filter((command) => command.id !== "palette").map((command) => ({ ...command, keys: command.keys ?? command.keys_there }));
    for (const node of index?.model.tree.nodes ?? []) {
      entries.push({
        id: `node.${node.id}`,
        title: node.name || node.type,
        group: `Node · ${node.type}`,
        run: () => {
          if (designs) return useEdit.setState({ wanted: { node: { id: node.type, name: node.name || node.type } } });
          select({ node: node.id, ...(node.leaf === null ? {} : { chart: node.leaf }) });
          go_to("mission");
        },
      });
    }
    for (const chart of index?.model.charts ?? []) {
      entries.push({
        id: `chart.${chart.id}`,
        title: chart.name,
        group: `Chart of a ${chart.kind}`,
        run: () => {
          if (designs && chart.file !== "") return useEdit.setState({ wanted: { file: chart.file, state: "" } });
          open_chart(chart.id);
          go_to("charts");
        },
      });
    }
    for (const monitor of index?.model.monitors ?? []) {
      entries.push({
        id: `monitor.${monitor.name}`,
        title: monitor.name,
        group: "Monitor",
        run: () => {
          select({ monitor: monitor.name });
          go_to("monitors");
        },
      });
    }
    return entries;
  }, [commands, index, designs]);
}

/** What is called so comes first, then what begins so. */
function rank({ title }: Entry, text: string): number {
  const [called, wanted] = [title.toLowerCase(), text.toLowerCase().trim()];
  return called === wanted ? 0 : called.startsWith(wanted) ? 1 : 2;
}

function PaletteList() {
  const [text, set_text] = useState("");
  const [chosen, set_chosen] = useState(0);
  const entries = useEntries();
  const found = useMemo(() => entries.filter((entry) => matches(text, `${entry.title} ${entry.group}`)).sort((a, b) => rank(a, text) - rank(b, text)).slice(0, kEntriesShownMax), [entries, text]);
  const at = Math.min(chosen, found.length - 1);
  const run = (entry: Entry | undefined) => {
    if (!entry) return;
    close();
    // After the dialog has given the focus back.
    setTimeout(() => entry.run());
  };
  const show = (next: number) => {
    set_chosen(next);
    document.getElementById(`palette-${next}`)?.scrollIntoView({ block: "nearest" });
  };
  return (
    <>
      <input
        className="palette-field"
        placeholder="A command, node, skill, monitor …"
        aria-label="Find"
        role="combobox"
        aria-expanded="true"
        aria-controls="palette-list"
        aria-activedescendant={`palette-${at}`}
        autoFocus
        value={text}
        onChange={(event) => {
          set_text(event.target.value);
          set_chosen(0);
        }}
        onKeyDown={(event) => {
          if (event.key === "ArrowDown") show(Math.min(at + 1, found.length - 1));
          else if (event.key === "ArrowUp") show(Math.max(at - 1, 0));
          else if (event.key === "Enter") run(found[at]);
          else return;
          event.preventDefault();
        }}
      />
      <ul id="palette-list" className="palette-list" role="listbox" aria-label="Found">
        {found.map((entry, i) => (
          <li key={entry.id} id={`palette-${i}`} role="option" aria-selected={i === at} className={i === at ? "chosen" : ""} onClick={() => run(entry)}>
            <span className="ellipsis">{entry.title}</span>
            <span className="palette-group">{entry.group}</span>
            {entry.keys?.map((key) => (
              <kbd key={key} className="kbd">
                {key}
              </kbd>
            ))}
          </li>
        ))}
        {found.length === 0 && <li className="muted">Nothing has these letters.</li>}
      </ul>
    </>
  );
}

export function Palette() {
  const open = usePalette((palette) => palette.open);
  useCommand({ id: "palette", title: "Find a command, a node, a chart", group: "Page", keys: ["Ctrl+K", "/"], run: open_palette });
  return open ? (
    <Dialog label="Find" className="palette" close={close}>
      <PaletteList />
    </Dialog>
  ) : null;
}
