import { useLayoutEffect, useRef, useState } from "react";

import type { EditedTransition } from "../protocol/types";
import { label_of, read_label } from "./chart_words";
import { focus_picture, gesture, useDesign } from "./design";
import { Options } from "./TextField";

const kWidthMin_px = 160;
const kWidthMax_px = 420;
const kSign_px = 7.3;

/** What a transition of a `version` waits for, written where it stands in the picture, at a point of the window. Enter, or leaving it, tells it. */
export function LabelField({ transition, version, x, y, options, close }: { transition: EditedTransition; version: number; x: number; y: number; options: readonly string[]; close(): void }) {
  const before = label_of(transition);
  const [text, set_text] = useState(before);
  const field = useRef<HTMLInputElement>(null);
  const ended = useRef(false);
  useLayoutEffect(() => field.current?.select(), []);
  const end = () => {
    ended.current = true;
    close();
  };
  const tell = () => {
    if (ended.current) return;
    const said = read_label(text);
    if (!said) return useDesign.setState({ refused: `“${text}” is no label: write event [condition], as tick [count > 2]` });
    end();
    if (said.event !== transition.event || said.condition !== transition.condition) void gesture({ what: "set_transition", transition: transition.transition, ...said }, version);
  };
  const keys = (pressed: React.KeyboardEvent) => {
    if (pressed.key === "Escape") end();
    else if (pressed.key === "Enter") tell();
    if (ended.current) focus_picture();
    // Whatever is pressed here is none of the picture's.
    pressed.stopPropagation();
  };
  const width = Math.min(Math.max(kWidthMin_px, text.length * kSign_px + 24), kWidthMax_px, window.innerWidth - 16);
  return (
    <>
      <input
        ref={field}
        className="field mono label-field"
        style={{ left: Math.max(8, Math.min(x, window.innerWidth - width - 8)), top: y, width }}
        aria-label="What the transition waits for: event [condition]"
        list="label-field-options"
        spellCheck={false}
        autoComplete="off"
        autoFocus
        value={text}
        onChange={(changed) => set_text(changed.target.value)}
        onKeyDown={keys}
        onBlur={tell}
        data-testid="label-field"
      />
      <Options id="label-field" options={options} />
    </>
  );
}
