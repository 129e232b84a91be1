import type { Data } from "../../protocol/types";
import { note } from "../../store/store";
import { code_of } from "./by_hand";
import { intervene } from "./steering";

/** Calls a service; a refusal, and a return code other than OK, are shown to the person. */
export async function call_service(service: string, method: string, args: Record<string, Data>): Promise<boolean> {
  const answer = await intervene({ call: `${service}.${method}`, args });
  if (!answer) return false;
  const code = code_of(answer.result);
  if (code === null || code === "OK") return true;
  note("error", `${service}.${method}: ${code.toLowerCase().replaceAll("_", " ")}`);
  return false;
}
