// The command line that renders the present scene.

import { is_object, type Json, type JsonObject } from "./json";

/** `text` as one word of a POSIX shell. */
function quoted(text: string): string {
  return /^[\w@%+=:,./-]+$/.test(text) ? text : "'" + text.replace(/'/g, "'\\''") + "'";
}

/** As --set reads it: JSON, or text that is not JSON. */
function written(value: Json): string {
  if (typeof value !== "string") return JSON.stringify(value);
  try {
    JSON.parse(value);
    return JSON.stringify(value);
  } catch {
    return value === "" ? '""' : value;
  }
}

function assignments(patch: JsonObject, prefix: string): string[] {
  return Object.entries(patch).flatMap(([key, value]) => {
    const name = prefix + key;
    const nested = is_object(value) && Object.keys(value).length > 0;
    return nested ? assignments(value, name + ".") : [name + "=" + written(value)];
  });
}

/** @param command  Renders the original scene. @param patch  From that to the present one. */
export function command_line(command: string[], patch: JsonObject): string {
  return [...command.map(quoted), ...assignments(patch, "").map((text) => "--set " + quoted(text))].join(" ");
}
