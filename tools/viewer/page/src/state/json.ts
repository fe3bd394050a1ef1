// JSON values, paths into them, and merge patches (RFC 7396).

export type Json = null | boolean | number | string | Json[] | JsonObject;
export interface JsonObject {
  [key: string]: Json;
}
export type Path = readonly string[];

export function is_object(value: Json | undefined): value is JsonObject {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

export function equal(a: Json | undefined, b: Json | undefined): boolean {
  if (a === b) return true;
  if (Array.isArray(a) && Array.isArray(b)) return a.length === b.length && a.every((item, i) => equal(item, b[i]));
  if (is_object(a) && is_object(b)) {
    const keys = Object.keys(a);
    return keys.length === Object.keys(b).length && keys.every((key) => key in b && equal(a[key], b[key]));
  }
  return false;
}

/** The value at `path`, or undefined if there is none. */
export function value_at(root: Json | undefined, path: Path): Json | undefined {
  let value = root;
  for (const key of path) {
    if (!is_object(value)) return undefined;
    value = value[key];
  }
  return value;
}

/** A copy of `root` with `value` at `path`. Objects on the way are made. */
export function with_value(root: JsonObject, path: Path, value: Json): JsonObject {
  const [key, ...rest] = path;
  if (key === undefined) return is_object(value) ? value : root;
  const child = root[key];
  return { ...root, [key]: rest.length === 0 ? value : with_value(is_object(child) ? child : {}, rest, value) };
}

/** A copy of `root` without the value at `path`. Objects on the way that become empty are removed, too. */
export function without_value(root: JsonObject, path: Path): JsonObject {
  const [key, ...rest] = path;
  if (key === undefined || !(key in root)) return root;
  const { [key]: child, ...others } = root;
  if (rest.length === 0) return others;
  if (!is_object(child)) return root;
  const remaining = without_value(child, rest);
  return Object.keys(remaining).length > 0 ? { ...root, [key]: remaining } : others;
}

/** The merge patch that makes `to` of `from`. Scenes contain no null, so it is exact. */
export function merge_patch(from: JsonObject, to: JsonObject): JsonObject {
  const patch: JsonObject = {};
  for (const key of Object.keys(from)) if (!(key in to)) patch[key] = null;
  for (const [key, value] of Object.entries(to)) {
    const old = from[key];
    if (equal(old, value)) continue;
    patch[key] = is_object(old) && is_object(value) ? merge_patch(old, value) : value;
  }
  return patch;
}

export function apply_patch(root: JsonObject, patch: JsonObject): JsonObject {
  const result = { ...root };
  for (const [key, value] of Object.entries(patch)) {
    const old = result[key];
    if (value === null) delete result[key];
    else result[key] = is_object(value) ? apply_patch(is_object(old) ? old : {}, value) : value;
  }
  return result;
}
