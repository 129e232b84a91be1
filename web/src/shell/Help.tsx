import { create } from "zustand";

import { useStudio } from "../store/store";
import { useCommand, useCommands, type Command } from "../widgets/commands";
import { Dialog } from "../widgets/Dialog";
import { Icon } from "../widgets/Icon";

const useHelp = create<{ open: boolean }>()(() => ({ open: false }));
export const open_help = () => useHelp.setState({ open: true });
const close = () => useHelp.setState({ open: false });

/** All commands with keys, by group: first those of what is on show. */
export function Help() {
  const open = useHelp((help) => help.open);
  const commands = useCommands((all) => all.commands);
  const version = useStudio((studio) => studio.hello?.version ?? "");
  useCommand({ id: "help", title: "Help and keys", group: "Page", keys: ["?"], run: open_help });
  if (!open) return null;
  const groups = new Map<string, Command[]>();
  // What a picture takes itself is of what one looks at.
  const listed = [...commands.values()].filter(({ keys, keys_there }) => keys ?? keys_there);
  for (const command of listed.sort((a, b) => Number(b.keys_there !== undefined) - Number(a.keys_there !== undefined))) groups.set(command.group, [...(groups.get(command.group) ?? []), command]);
  return (
    <Dialog label="Help and keys" className="help" close={close}>
      <header className="dialog-bar">
        <h2>Keys</h2>
        <button className="icon-button" onClick={close} aria-label="Close">
          <Icon name="close" />
        </button>
      </header>
      <div className="help-scroll" tabIndex={0}>
        <div className="help-groups">
          {[...groups].map(([group, members]) => (
            <section key={group}>
              <h3>{group}</h3>
              <dl>
                {members.map((command) => (
                  <div key={command.id} className="help-line">
                    <dt>{command.title}</dt>
                    <dd>
                      {(command.keys ?? command.keys_there)?.map((key) => (
                        <kbd key={key} className="kbd">
                          {key}
                        </kbd>
                      ))}
                    </dd>
                  </div>
                ))}
              </dl>
            </section>
          ))}
        </div>
      </div>
      <footer className="dialog-foot muted">
        Tab goes from part to part, arrow keys move inside one. Borders between panels move with arrow keys too. Sentree {version} ·{" "}
        <a href="./assets/notices.txt" target="_blank" rel="noreferrer">
          packages in this page
        </a>
      </footer>
    </Dialog>
  );
}
