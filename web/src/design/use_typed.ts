import { useEffect, useRef, useState } from "react";

/**
 * What a field needs that tells its text, once, when one leaves it or presses Enter; Escape, and a refusal (false), bring
 * back what is written.
 */
export function useTyped(written: string, tell: (typed: string) => Promise<boolean>) {
  const [typed, set_typed] = useState(written);
  const told = useRef(written);
  const back = () => {
    told.current = written;
    set_typed(written);
  };
  useEffect(() => {
    told.current = written;
    set_typed(written);
  }, [written]);
  const done = () => {
    const text = typed.trim();
    if (text === told.current) return;
    told.current = text;
    void tell(text).then((was_done) => !was_done && back());
  };
  return {
    value: typed,
    spellCheck: false,
    autoComplete: "off",
    "data-unsent": typed !== written,
    onChange: (event: React.ChangeEvent<HTMLInputElement | HTMLTextAreaElement>) => set_typed(event.target.value),
    onBlur: done,
    onKeyDown: (event: React.KeyboardEvent) => {
      if (event.key === "Enter") done();
      if (event.key === "Escape") back();
    },
  };
}
