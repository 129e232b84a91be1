import { useEffect, useRef, useState, type ReactNode, type SyntheticEvent } from "react";

/**
 * A modal dialog of the browser: keeps the focus inside, closes with Escape and by a click beside it; then the focus is where it was.
 *
 * With Escape it is gone at once. A dialog that the browser closes stands there until it has told so, unseen and with the
 * focus in its field, and the next key would be that field's.
 */
export function Dialog({ label, className, close, children }: { label: string; className: string; close(): void; children: ReactNode }) {
  const dialog = useRef<HTMLDialogElement>(null);
  // Before a field of it takes the focus.
  const [before] = useState(() => document.activeElement);
  useEffect(() => {
    dialog.current?.showModal();
    return () => {
      const lost = document.activeElement === null || document.activeElement === document.body;
      if (lost && (before instanceof HTMLElement || before instanceof SVGElement)) before.focus({ preventScroll: true });
    };
  }, [before]);
  const cancel = (event: SyntheticEvent) => {
    event.preventDefault();
    close();
  };
  return (
    <dialog ref={dialog} className={`dialog ${className}`} aria-label={label} onCancel={cancel} onClose={close} onClick={(event) => event.target === event.currentTarget && close()}>
      {children}
    </dialog>
  );
}
