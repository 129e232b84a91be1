import type { Data } from "../../protocol/types";
import { note } from "../../store/store";
import { steer } from "./steering";

/** The return code in an answer of a service of the robot; null: it has none. */
export function code_of(result: Data | undefined): string | null {
  if (typeof result === "string" && /^[A-Z][A-Z_]*$/.test(result)) return result;
  if (typeof result === "object" && result !== null && !Array.isArray(result) && typeof result["code"] === "string") {
    const error = result["error_code"];
    return typeof error === "string" && error !== "NONE" ? error : result["code"];
  }
  return null;
}

/** Calls a service; a refusal, and a return code other than OK, are shown to the person. */
export async function call_service(service: string, method: string, args: Record<string, Data>): Promise<boolean> {
  const answer = await steer("call", { service, method, args });
  if (!answer) return false;
  const code = code_of(answer.result);
  if (code === null || code === "OK") return true;
  note("error", `${service}.${method}: ${code.toLowerCase().replaceAll("_", " ")}`);
  return false;
}
