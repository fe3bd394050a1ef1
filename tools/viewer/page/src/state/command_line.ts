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

/** @param patch  From the scene of `file` to the present one. */
export function command_line(file: string, patch: JsonObject): string {
  // A value that begins with a dash would be an option.
  const scene = quoted(file.startsWith("-") ? "./" + file : file);
  return ["tensorray render " + scene, ...assignments(patch, "").map((text) => "--set " + quoted(text))].join(" ");
}
