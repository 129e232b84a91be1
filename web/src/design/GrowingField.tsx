import { useLayoutEffect, useRef } from "react";

import type { useTyped } from "./use_typed";

interface GrowingFieldProps {
  id: string;
  hint?: string | undefined;
  typed: ReturnType<typeof useTyped>;
}

/** One line of text, as high as it needs to be seen whole. Enter tells it. */
export function GrowingField({ id, hint, typed }: GrowingFieldProps) {
  const place = useRef<HTMLTextAreaElement>(null);
  const { value } = typed;
  useLayoutEffect(() => {
    const field = place.current;
    if (!field) return;
    const grow = () => {
      field.style.height = "0";
      field.style.height = `${field.scrollHeight + field.offsetHeight - field.clientHeight}px`;
    };
    grow();
    let width = field.clientWidth;
    const observer = new ResizeObserver(() => {
      if (field.clientWidth === width) return;
      width = field.clientWidth;
      grow();
    });
    observer.observe(field);
    return () => observer.disconnect();
  }, [value]);
  return (
    <textarea
      ref={place}
      id={id}
      className="field mono growing"
      rows={1}
      style={{ width: `${Math.max(value.length, 8) + 3}ch` }}
      placeholder={hint}
      {...typed}
      onChange={(event) => {
        // Pasted lines too would be another text.
        event.target.value = event.target.value.replace(/\s*\n\s*/g, " ");
        typed.onChange(event);
      }}
      onKeyDown={(event) => {
        // A line of its own would be another text.
        if (event.key === "Enter") event.preventDefault();
        typed.onKeyDown(event);
      }}
    />
  );
}
