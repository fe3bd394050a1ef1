// Reads the JSON Schema of scene files, and checks values against it.

import { equal, is_object, value_at, type Json, type JsonObject, type Path } from "./json";

export type Schema = JsonObject;

export function properties_of(schema: Schema): [string, Schema][] {
  const properties = schema["properties"];
  return is_object(properties) ? (Object.entries(properties) as [string, Schema][]) : [];
}

export function text_of(schema: Schema, key: "description" | "type"): string {
  const text = schema[key];
  return typeof text === "string" ? text : "";
}

export function number_of(schema: Schema, key: string): number | undefined {
  const value = schema[key];
  return typeof value === "number" ? value : undefined;
}

/** The schema of the key at `path`; null if there is no such key. */
export function schema_at(root: Schema, path: Path): Schema | null {
  let schema: Schema = root;
  for (const key of path) {
    const next = value_at(schema, ["properties", key]);
    if (!is_object(next)) return null;
    schema = next;
  }
  return schema;
}

export function alternatives_of(schema: Schema): Schema[] {
  const list = schema["anyOf"] ?? schema["oneOf"];
  return Array.isArray(list) ? list.filter(is_object) : [];
}

/** The alternatives of objects that differ in the constant `kind`; empty if `schema` is no such choice. */
export function kinds_of(schema: Schema): [string, Schema][] {
  const kinds = alternatives_of(schema).map((alternative): [string, Schema] => {
    const kind = value_at(alternative, ["properties", "kind", "const"]);
    return [typeof kind === "string" ? kind : "", alternative];
  });
  return kinds.every(([kind]) => kind !== "") ? kinds : [];
}

/** Names that a value may have, of an enum or of the constants among alternatives. */
export function names_of(schema: Schema): string[] {
  const names = schema["enum"];
  if (Array.isArray(names)) return names.filter((name) => typeof name === "string");
  return alternatives_of(schema).flatMap((alternative) => {
    const name = alternative["const"];
    return typeof name === "string" ? [name] : [];
  });
}

/** The kinds of an object to which its key `key` belongs; null if it belongs to all. */
export function owners_of(schema: Schema, key: string): string[] | null {
  const rules = schema["allOf"];
  if (!Array.isArray(rules)) return null;
  for (const rule of rules) {
    if (!is_object(rule)) continue;
    const [condition, exclusion] = alternatives_of(rule);
    const excluded = value_at(exclusion, ["not", "required"]);
    const kinds = value_at(condition, ["properties", "kind", "enum"]);
    if (Array.isArray(excluded) && excluded.includes(key) && Array.isArray(kinds)) {
      return kinds.filter((kind) => typeof kind === "string");
    }
  }
  return null;
}

export function is_required(schema: Schema, key: string): boolean {
  const required = schema["required"];
  return Array.isArray(required) && required.includes(key);
}

/** The kind of an object: its own or the default. */
export function kind_of(schema: Schema, value: Json | undefined): string | undefined {
  const kind = value_at(value, ["kind"]) ?? value_at(schema, ["properties", "kind", "default"]);
  return typeof kind === "string" ? kind : undefined;
}

/** A copy of an object with another kind, without the keys that do not belong to it. */
export function with_kind(schema: Schema, object: JsonObject, kind: string): JsonObject {
  const result: JsonObject = { ...object, kind };
  for (const key of Object.keys(object)) {
    const owners = owners_of(schema, key);
    if (key !== "kind" && owners && !owners.includes(kind)) delete result[key];
  }
  return result;
}

function is_of_type(value: Json, type: string): boolean {
  switch (type) {
    case "integer":
      return typeof value === "number" && Number.isInteger(value);
    case "array":
      return Array.isArray(value);
    case "object":
      return is_object(value);
    case "null":
      return value === null;
    default:
      return typeof value === type;
  }
}

/** What is wrong with `value`, as a short sentence; null if nothing is. The server checks the rest. */
export function fault_of(schema: Schema, value: Json): string | null {
  // A number, or a list of numbers, may have keyframes.
  if (is_object(value) && "keys" in value && text_of(schema, "type") !== "object") return null;
  const alternatives = alternatives_of(schema);
  if (alternatives.length > 0 && !is_object(value)) {
    const faults = alternatives.map((alternative) => fault_of(alternative, value));
    if (!faults.includes(null)) return faults.find((fault) => fault !== null) ?? null;
  }
  if ("const" in schema && !equal(schema["const"], value)) return "Must be " + JSON.stringify(schema["const"]) + ".";
  const names = schema["enum"];
  if (Array.isArray(names) && !names.some((name) => equal(name, value))) return "Must be one of " + names.join(", ") + ".";
  const type = text_of(schema, "type");
  if (type && !is_of_type(value, type)) {
    return "Must be " + ({ integer: "an integer", array: "a list", object: "an object" }[type] ?? "a " + type) + ".";
  }
  if (typeof value === "number") {
    const least = number_of(schema, "minimum");
    const above = number_of(schema, "exclusiveMinimum");
    const greatest = number_of(schema, "maximum");
    if (least !== undefined && value < least) return `Must be ${least} or more.`;
    if (above !== undefined && value <= above) return `Must be more than ${above}.`;
    if (greatest !== undefined && value > greatest) return `Must be ${greatest} or less.`;
  }
  if (typeof value === "string") {
    if (value.length < (number_of(schema, "minLength") ?? 0)) return "Must not be empty.";
    const pattern = schema["pattern"];
    if (typeof pattern === "string" && !new RegExp(pattern).test(value)) return "Does not have the form " + pattern + ".";
  }
  if (Array.isArray(value)) {
    const least = number_of(schema, "minItems") ?? 0;
    const greatest = number_of(schema, "maxItems") ?? Infinity;
    if (value.length < least || value.length > greatest) {
      return least === greatest ? `Must have ${least} items.` : `Must have ${least} items or more.`;
    }
    const items = schema["items"];
    if (is_object(items)) {
      for (const [i, item] of value.entries()) {
        const fault = fault_of(items, item);
        if (fault) return `Item ${i + 1}: ${fault}`;
      }
    }
  }
  if (is_object(value)) {
    for (const [key, child] of properties_of(schema)) {
      const item = value[key];
      const fault = item === undefined ? null : fault_of(child, item);
      if (fault) return `${key}: ${fault}`;
    }
  }
  return null;
}
