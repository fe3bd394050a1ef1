// The state in the page's address: "#" and the merge patch from the original scene, as base64url.

import { is_object, type Json, type JsonObject } from "./json";

/** The fragment for `patch`, with its "#"; empty if nothing was changed. */
export function fragment_of(patch: JsonObject): string {
  if (Object.keys(patch).length === 0) return "";
  let bytes = "";
  for (const byte of new TextEncoder().encode(JSON.stringify(patch))) bytes += String.fromCharCode(byte);
  return "#" + btoa(bytes).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** The patch in `fragment`; null if there is none, or if it cannot be read. */
export function patch_of(fragment: string): JsonObject | null {
  try {
    const bytes = atob(fragment.replace(/^#/, "").replace(/-/g, "+").replace(/_/g, "/"));
    const text = new TextDecoder().decode(Uint8Array.from(bytes, (c) => c.charCodeAt(0)));
    const patch = JSON.parse(text) as Json;
    return is_object(patch) ? patch : null;
  } catch {
    return null;
  }
}
