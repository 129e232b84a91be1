import { useEffect, useRef, type ReactNode } from "react";

/** A modal dialog of the browser: keeps the focus inside, closes with Escape and by a click beside it. */
export function Dialog({ label, className, close, children }: { label: string; className: string; close(): void; children: ReactNode }) {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    dialog.current?.showModal();
  }, []);
  return (
    <dialog ref={dialog} className={`dialog ${className}`} aria-label={label} onClose={close} onClick={(event) => event.target === event.currentTarget && close()}>
      {children}
    </dialog>
  );
}
