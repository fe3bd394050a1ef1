// Reads the JSON Schema of scene files. The server checks values against it.

import { is_object, value_at, type Json, type JsonObject } from "./json";

export type Schema = JsonObject;

function list_of(value: Json | undefined): Json[] {
  return Array.isArray(value) ? value : [];
}

export function properties_of(schema: Schema): [string, Schema][] {
  const properties = schema["properties"];
  return is_object(properties) ? (Object.entries(properties) as [string, Schema][]) : [];
}

export function text_of(schema: Schema, key: "description" | "type"): string {
  const text = schema[key];
  return typeof text === "string" ? text : "";
}

export function texts_of(schema: Schema, key: "enum" | "examples" | "required"): string[] {
  return list_of(schema[key]).filter((text) => typeof text === "string");
}

function alternatives_of(schema: Schema): Schema[] {
  return list_of(schema["anyOf"] ?? schema["oneOf"]).filter(is_object);
}

/** The schema of a value that is no word, such as "auto". */
export function main_schema(schema: Schema): Schema {
  return alternatives_of(schema)[0] ?? schema;
}

/** The word that a value may be besides; null if there is none. */
export function word_of(schema: Schema): string | null {
  const words = alternatives_of(schema).map((alternative) => alternative["const"]);
  return words.find((word) => typeof word === "string") ?? null;
}

/** The alternatives of objects that differ in the constant `kind`; empty if `schema` is no such choice. */
export function kinds_of(schema: Schema): [string, Schema][] {
  return alternatives_of(schema).flatMap((alternative): [string, Schema][] => {
    const kind = value_at(alternative, ["properties", "kind", "const"]);
    return typeof kind === "string" ? [[kind, alternative]] : [];
  });
}

/** Those of `names` that a description begins with, as "path_tracing, scene: ..."; null: the key is for all. */
export function users_of(schema: Schema, names: string[]): string[] | null {
  const users = /^(\w+(?:, \w+)*): /.exec(text_of(schema, "description"))?.[1]?.split(", ");
  return users?.every((user) => names.includes(user)) ? users : null;
}

/** A copy of an object with `value` at `key`, without the keys that its schema does not allow beside it. */
export function with_key(schema: Schema, object: JsonObject, key: string, value: Json): JsonObject {
  const alternatives = list_of(schema["oneOf"]).flatMap((alternative) => list_of(value_at(alternative, ["required"])));
  const excluded = alternatives.includes(key) ? alternatives : [];
  for (const rule of list_of(schema["allOf"]).filter(is_object)) {
    const pair = list_of(value_at(rule, ["not", "required"]));
    if (pair.includes(key)) excluded.push(...pair);
    const [condition, exclusion] = alternatives_of(rule);
    const values = value_at(condition, ["properties", key, "enum"]);
    if (Array.isArray(values) && !values.includes(value)) excluded.push(...list_of(value_at(exclusion, ["not", "required"])));
  }
  const kept = Object.entries(object).filter(([other]) => !excluded.includes(other));
  return { ...Object.fromEntries(kept), [key]: value };
}
