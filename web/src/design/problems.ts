import { useMemo } from "react";

import type { Design, Finding } from "../protocol/types";
import { doc_of, kNoFindings, useDesign, type Doc } from "./design";
import { line_start } from "./places";

/** What is wrong in the project, and why the open file cannot be read, where that is not among it: files of others are not checked. */
export function problems_of(summary: Design | null, doc: Doc | null): readonly Finding[] {
  const findings = summary?.findings ?? kNoFindings;
  // Else the check is still to tell of it.
  if (!doc?.error || !summary?.checked || findings.some(({ file, line }) => file === doc.file && line > 0)) return findings;
  const { line, column, message } = doc.error;
  const from = doc.places.byte(line_start(doc.places.shown, line));
  return [...findings, { file: doc.file, line, column, from, to: from, severity: "warning", code: "", message, fixes: [] }];
}

export function useProblems(): readonly Finding[] {
  const summary = useDesign((state) => state.summary);
  const doc = useDesign(doc_of);
  return useMemo(() => problems_of(summary, doc), [summary, doc]);
}
